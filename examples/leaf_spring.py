"""A tapered leaf spring.

A parabolic leaf spring lies along an arc; its height decreases from the middle to the eyes. Nine
loads, computed together as samples, press it flat and beyond. The natural frequency is computed
under each load.
"""

import numpy as np

import flexband as fb

SPAN, CAMBER = 1.2, 0.12  # m
THICK, THIN, WIDTH = 0.016, 0.008, 0.07  # m
SPRING_STEEL = {"density": 7850.0, "youngs_modulus": 206e9, "poissons_ratio": 0.29}
LOADS = np.linspace(0.0, 8000.0, 9)  # N


def arc(u):
    return np.stack([SPAN * u, CAMBER * 4 * u * (1 - u)], axis=-1)


def height(x):
    """Return the height [m] at the position x [m] along the leaf."""
    distance = np.abs(2 * x / LEAF - 1)  # 0 in the middle, 1 at the eyes
    return THIN + (THICK - THIN) * np.sqrt(np.clip(1 - distance, 0.0, 1.0))


LEAF = fb.Beam.along(arc, height=THICK, width=WIDTH, elements=2, **SPRING_STEEL).length


def leaf_spring(force):
    leaf = fb.Beam.along(arc, height=height, width=WIDTH, elements=24, **SPRING_STEEL)
    return fb.Mechanism(
        bodies={"leaf": leaf},
        joints={
            "eye": fb.Revolute("leaf.start", (0.0, 0.0)),
            "shackle": fb.Slot("leaf.end", (0.0, 0.0)),
        },
        loads={"axle": fb.Force("leaf.middle", y=-force)},
        sensors={
            **{f"node {k}": fb.Position(f"leaf.node {k}") for k in range(25)},
            "middle": fb.Position("leaf.middle"),
        },
    )


def picture(drawing, plot):
    fb.draw(leaf_spring(LOADS), axes=drawing, sample=1)
    rest = fb.equilibrium(leaf_spring(LOADS), steps=4)
    for places in rest.values[2::2, :50]:
        drawing.plot(places[::2], places[1::2], color="#1f78b4", alpha=0.4)
    sunk = 1e3 * (CAMBER - rest.sel(output="middle_Y"))
    plot.plot(sunk, 1e-3 * LOADS, "o-", color="#1f78b4")
    plot.set(xlabel="deflection [mm]", ylabel="load [kN]")
    first = fb.modes(leaf_spring(LOADS), 1, steps=4)["frequency"]
    other = plot.twinx()
    other.plot(sunk, first, "s-", color="#d95f02")
    other.set_ylabel("frequency [Hz]", color="#d95f02")
