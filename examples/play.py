"""How far play in its pins moves a function generator.

Each pin may be anywhere in a disc of radius 0.5 mm at every instant. Bounds of the rocker's angle
hold for every motion of the pins in their holes. A simulation in which one pin flies through its
hole and hits it stays inside the bounds of this pin's play, but for the depth of its impacts.
"""

import numpy as np

import flexband as fb

CRANK, COUPLER, ROCKER, GROUND = 0.053, 0.122, 0.0665, 0.1  # m
PLAY = 0.5e-3  # m: hole's radius less the pin's
START, OUT, TURN = np.deg2rad([95.5, 75.760144, 120.0])  # of crank and rocker; crank's way in 1 s
BAR = {"height": 0.01, "width": 0.01, "density": 7800.0}
HIT = fb.contact.HuntCrossley(stiffness=1e9, restitution=0.5)  # N/m^1.5
FIXED = (0.0, 0.0)


def generator(A=FIXED, B=FIXED, C=FIXED, D=FIXED, *, clearance=None):
    end = CRANK * np.array([np.cos(START), np.sin(START)])
    way = np.array([GROUND + ROCKER * np.cos(OUT), ROCKER * np.sin(OUT)]) - end
    bars = {"crank": (CRANK, FIXED, START), "rocker": (ROCKER, (GROUND, 0.0), OUT)}
    bars["coupler"] = COUPLER, tuple(end), np.arctan2(way[1], way[0])
    hole = {"offset": C} if clearance is None else {"clearance": clearance, "law": HIT}
    return fb.Mechanism(
        bodies={
            name: fb.RigidBody.bar(length=length, start=start, angle=angle, **BAR)
            for name, (length, start, angle) in bars.items()
        },
        joints={
            "A": fb.Revolute(FIXED, "crank.start", offset=A),
            "B": fb.Revolute("crank.end", "coupler.start", offset=B),
            "C": fb.Revolute("coupler.end", "rocker.end", **hole),
            "D": fb.Revolute((GROUND, 0.0), "rocker.start", offset=D),
            "motor": fb.PrescribedRotation("crank", lambda t: START + TURN * t),
        },
        loads={"gravity": fb.Gravity()},
        sensors={"rocker": fb.Angle("rocker")},
    )


response = fb.dynamic_response(generator, duration=1.0, step=0.02)
study = fb.Study(response, {name: fb.Play(PLAY) for name in "ABCD"}, fb.AdaptivePCCI(1e-3))


def picture(drawing, plot):
    fb.draw(generator(), axes=drawing)
    fine = fb.simulate(generator(), duration=1.0, step=0.002).values[0]
    for pins, color in (("ABCD", "0.85"), ("C", "0.65")):
        inputs = {name: fb.Play(PLAY) for name in pins}
        bands = fb.propagate(response, inputs, fb.AdaptivePCCI(1e-3))["mean"].values[:, 0]
        off = np.rad2deg(bands - fine[::10])
        plot.fill_between(response()["time"], *off, color=color, label=f"play in {pins}", lw=0)
    hits = fb.simulate(generator(clearance=PLAY), duration=1.0, step=0.002)
    plot.plot(hits.time, np.rad2deg(hits.values[0] - fine), lw=0.6, label="contact in C")
    plot.set(xlabel="time [s]", ylabel="rocker's deviation [°]", ylim=(-3.2, 2.2))
    plot.legend(loc="lower right")
