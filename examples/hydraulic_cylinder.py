"""A hydraulic cylinder behind a valve.

A valve lets oil into one chamber of a cylinder and out of the other; the piston moves a mass
against a damper. The pressures of both chambers are first-order states of a force law, much
faster than the motion: oil is stiff.
"""

import numpy as np

import flexband as fb

MASS, DAMPING = 50.0, 2000.0  # kg, N s/m
OPENING = 4e-8  # m³/s/√Pa: flow through an edge of the valve per root of the pressure drop
SUPPLY, START = 1e7, 3e6  # Pa: pressure of the pump; of both chambers at the start
AREA, BULK, VOLUME, STROKE = 1e-3, 1e9, 3e-4, 0.5  # m², Pa, m³, m: at the start


def valve(t, x, v, s, p, force, rate):
    """Set the piston's force and the rates of the pressures s; x[2, 0] is the cylinder's length."""
    opening, supply, area, bulk, volume, start = p[0], p[1], p[2], p[3], p[4], p[5]
    stroke, speed = x[2, 0] - start, v[2, 0]
    inflow = opening * np.sign(supply - s[0]) * np.sqrt(abs(supply - s[0]))
    outflow = opening * np.sign(s[1]) * np.sqrt(abs(s[1]))
    rate[0] = bulk / (volume + area * stroke) * (inflow - area * speed)
    rate[1] = bulk / (volume - area * stroke) * (area * speed - outflow)
    force[2, 0] = area * (s[0] - s[1])


def cylinder(opening=OPENING):
    parameters = (opening, SUPPLY, AREA, BULK, VOLUME, STROKE)
    return fb.Mechanism(
        bodies={"mass": fb.RigidBody(mass=MASS, inertia=1.0, position=(STROKE, 0.0))},
        joints={"guide": fb.Prismatic("mass", (0.0, 0.0))},
        loads={
            "oil": fb.ForceLaw(["mass", (0.0, 0.0)], valve, parameters, between=[(0, 1)],
                               states={"a": START, "b": START}),
            "damper": fb.ViscousFriction("mass", (0.0, 0.0), DAMPING),
        },
        sensors={
            "travel": fb.Position("mass"),
            "velocity": fb.Velocity("mass"),
            "a": fb.LawState("oil", "a", "Pa"),
            "b": fb.LawState("oil", "b", "Pa"),
        },
    )  # fmt: skip


def motion():
    return fb.simulate(cylinder(), duration=0.2, step=1e-4)


def picture(drawing, plot):
    fb.draw(cylinder(), axes=drawing)
    result = motion()
    for name, color in (("a", "#1f78b4"), ("b", "#d95f02")):
        plot.plot(result.time, 1e-5 * result.sel(output=name), color=color, label=f"chamber {name}")
    plot.set(xlabel="time [s]", ylabel="pressure [bar]")
    plot.legend()
