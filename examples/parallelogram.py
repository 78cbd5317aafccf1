"""A parallelogram linkage with redundant joints.

A third crank makes the linkage stiffer and carries it through the positions in which all bars lie
on a line, but its constraints are redundant: the motion is unique, the forces in the three cranks
are not, and the result lists the joints concerned.
"""

import numpy as np

import flexband as fb

CRANK, PITCH = 0.2, 0.35  # m
STEEL = {"height": 0.03, "width": 0.01, "density": 7800.0}  # m, m, kg/m³


def angle(t):
    return np.pi / 3 + 5.0 * t**2  # rad: constant acceleration


def parallelogram():
    bodies = {"coupler": fb.RigidBody.block(
        length=2 * PITCH, **STEEL, position=(PITCH + 0.1, 0.17),
        points={"0": (-PITCH, 0.0), "1": (0.0, 0.0), "2": (PITCH, 0.0)},
    )}  # fmt: skip
    joints = {"motor": fb.PrescribedRotation("crank 0", angle)}
    for k in range(3):
        place = (k * PITCH, 0.0)
        bodies[f"crank {k}"] = fb.RigidBody.bar(length=CRANK, start=place, angle=angle(0), **STEEL)
        joints[f"A{k}"] = fb.Revolute(f"crank {k}.start", place)
        joints[f"B{k}"] = fb.Revolute(f"coupler.{k}", f"crank {k}.end")
    return fb.Mechanism(
        bodies=bodies,
        joints=joints,
        loads={"gravity": fb.Gravity()},
        sensors={
            "coupler": fb.Position("coupler"),
            "turn": fb.Angle("coupler"),
            "kinetic": fb.KineticEnergy(),
            "potential": fb.PotentialEnergy(),
            "work": fb.Work("motor"),
        },
    )


def motion():
    return fb.simulate(parallelogram(), duration=1.5, step=1e-3)


def picture(drawing, plot):
    fb.draw(parallelogram(), axes=drawing, dimensions=False)
    result = motion()
    energy = result.sel(output=["kinetic", "potential", "work"])
    plot.plot(result.time, energy.T, label=["kinetic energy", "potential energy", "motor's work"])
    plot.set(xlabel="time [s]", ylabel="energy [J]")
    plot.set_title(
        "joints that share forces: "
        + ", ".join(n.split("'")[1] for n in result.attrs["not_unique"])
    )
    plot.legend()
