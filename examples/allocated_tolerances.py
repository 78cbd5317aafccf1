"""A four-bar linkage with a flexible coupler whose tolerances are allocated.

The middle of the coupler has to follow its nominal path within ± 0.45 mm, and the horizontal force
on bearing D may be 1 % larger than nominal. Which tolerances of four lengths and of the coupler's
height are the cheapest, and do 10 000 samples meet the requirements?
"""

import numpy as np

import flexband as fb

SIZES = {"crank": 0.08, "coupler": 0.30, "rocker": 0.20, "ground": 0.32, "height": 0.012}  # m
STEEL = {"height": 0.012, "width": 0.01, "density": 7800.0}  # m, m, kg/m³
SENSORS = {"middle": fb.Position("coupler.0.5"), "D": fb.Reaction("D")}
POLYAMIDE = {"width": 0.01, "density": 1140.0, "youngs_modulus": 2.8e9, "poissons_ratio": 0.39}
COSTS = {"crank": 1e-3, "coupler": 2e-3, "rocker": 1e-3, "ground": 2e-3, "height": 5e-4}  # m


def four_bar(crank, coupler, rocker, ground, height):
    beam = {"length": coupler, "height": height, "start": (0.04, 0.07), "angle": 0.4}
    bodies = {
        "crank": fb.RigidBody.bar(length=crank, angle=np.pi / 3, **STEEL),
        "coupler": fb.Beam(**beam, **POLYAMIDE, retardation_time=2e-3, elements=2),
        "rocker": fb.RigidBody.bar(length=rocker, start=(ground, 0.0), angle=1.6, **STEEL),
    }
    joints = {
        "A": fb.Revolute("crank.start", (0.0, 0.0)),
        "B": fb.Revolute("coupler.start", "crank.end"),
        "C": fb.Revolute("coupler.end", "rocker.end"),
        "D": fb.Revolute("rocker.start", (ground, 0.0)),
        "motor": fb.PrescribedRotation("crank", lambda t: np.pi / 3 + 6 * np.pi * t),
    }
    return fb.Mechanism(bodies=bodies, joints=joints, sensors=SENSORS)


response = fb.dynamic_response(four_bar, duration=0.35, step=1e-4, output_step=1e-3)
inputs = {name: fb.Interval.around(size, tolerance=5e-4) for name, size in SIZES.items()}
nominal = response(**{name: np.array([size]) for name, size in SIZES.items()})[0]
path, force = nominal.sel(output="middle_Y").values, float(nominal.sel(output="D_X").max())
on_path = fb.Requirement("middle_Y", above=path - 4.5e-4, below=path + 4.5e-4)
requirements = [on_path, fb.Requirement("D_X", below=1.01 * force)]
surrogate = fb.expand(response, inputs, fb.AdaptivePCCI(tolerance=0.01))
allocation = fb.analysis.allocate(surrogate, requirements, COSTS, response=response)


def sampled(count=10_000):
    rng, tolerances = np.random.default_rng(0), allocation["tolerance"].to_series()
    return response(**{k: SIZES[k] + t * rng.uniform(-1, 1, count) for k, t in tolerances.items()})


def picture(drawing, plot):
    fb.draw(four_bar(**SIZES), axes=drawing)
    off = 1e3 * (sampled().sel(output="middle_Y") - path)
    plot.fill_between(off.time, off.min("sample"), off.max("sample"))
    plot.hlines([-0.45, 0.45], *off.time[[0, -1]], color="black")
    plot.set(xlabel="time [s]", ylabel="deviation of 10 000 samples [mm]", ylim=(-0.5, 0.5))


if __name__ == "__main__":
    print(allocation.attrs["verdict"])
