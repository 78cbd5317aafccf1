"""Masses on bristles, drawn at random, in chosen steps, against SciPy's integration.

A spring drags a mass with LuGre's friction (Canudas de Wit et al., IEEE Trans. Automat. Contr. 40
(1995) 419), which slips all the time, now and then or never. Errors are the largest ones of the
place, relative to its range.

    python -m benchmarks.friction.bristles --seed 1 --samples 200
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

import flexband as fb
from benchmarks.harness import options, report


def bristles(t, x, v, s, p, force, rate):
    """Hold a mass by bristles whose deflection is s."""
    stiffness, damping, coulomb, stiction, stribeck = p
    slip = v[0, 0]
    limit = coulomb + (stiction - coulomb) * np.exp(-((slip / stribeck) ** 2))
    rate[0] = slip - stiffness * abs(slip) / limit * s[0]
    force[0, 0] = -stiffness * s[0] - damping * rate[0]


def error(seed: int) -> float:
    """Return the error of a mass at the default tolerance of chosen steps."""
    rng = np.random.default_rng(seed)
    stiffness = 10 ** rng.uniform(3, 6)
    mass = 10 ** rng.uniform(-0.5, 1.0)
    coulomb = rng.uniform(0.5, 3)
    ratio = rng.uniform(1, 1.6)
    stribeck = 10 ** rng.uniform(-3, -1)
    K = rng.uniform(0.5, 20)
    c = rng.uniform(0, 0.6)
    speed = rng.uniform(0.02, 0.5)
    duration = rng.uniform(2, 15)
    p = np.array([stiffness, np.sqrt(stiffness * mass), coulomb, coulomb * ratio, stribeck])

    def rates(t, y):
        force = np.zeros((1, 3))
        rate = np.zeros(1)
        bristles(t, np.zeros((1, 3)), np.array([[y[1], 0.0, 0.0]]), y[2:], p, force, rate)
        return [y[1], (force[0, 0] - c * y[1] - K * (y[0] - speed * t)) / mass, rate[0]]

    model = fb.Mechanism(
        bodies={"mass": fb.PointMass(mass=mass)},
        joints={"rail": fb.Slot("mass", (0.0, 0.0))},
        loads={
            "bristles": fb.ForceLaw(["mass"], bristles, p.tolist(), states={"z": 0.0}),
            "spring": fb.Spring("mass", (-1.0, 0.0), stiffness=K, damping=c, rest_length=1.0),
            "drag": fb.Force("mass", x=lambda t: K * speed * t),
        },
        sensors={"place": fb.Position("mass")},
    )
    integrator = fb.GeneralizedAlpha(step_tolerance=1e-7)
    motion = fb.simulate(model, duration=duration, step=duration / 200, integrator=integrator)
    place = motion.sel(output="place_X").values.ravel()
    times = motion["time"].values
    exact = solve_ivp(
        rates, (0.0, times[-1]), np.zeros(3), "Radau", times, rtol=1e-10, atol=1e-13
    ).y[0]
    return float(np.abs(place - exact).max() / np.ptp(exact))


def main() -> None:
    arguments = options(__doc__, 200, seed=(1, "first of the seeds"))
    seeds = range(arguments.seed, arguments.seed + arguments.samples)
    errors = [error(seed) for seed in seeds]
    quantiles = np.quantile(errors, [0.5, 0.9, 0.99, 1.0])
    above = f"{sum(e > 2e-4 for e in errors)} of {len(errors)}"
    report(
        arguments.output,
        "bristles",
        ["median", "90 %", "99 %", "largest", "above 2e-4"],
        [[*(f"{q:.1e}" for q in quantiles), above]],
        dict(zip(map(str, seeds), errors, strict=True)),
    )


if __name__ == "__main__":
    main()
