"""An arm with a PID controller.

A motor turns an arm under gravity to an angle of 0.3 rad. Its moment is that of a PID controller,
written as a force law: the integral of the error is a first-order state of the law, which the
engine integrates with the motion.
"""

import flexband as fb

ARM = {"length": 0.5, "height": 0.03, "width": 0.02, "density": 2700.0}  # m, kg/m³
TARGET, PROPORTIONAL, INTEGRAL, DERIVATIVE = 0.3, 20.0, 30.0, 3.0  # rad, N m/rad, …


def pid(t, x, v, s, p, force, rate):
    """Set the moment on the arm, and the rate of the integral s[0] of the error."""
    error = p[0] - x[0, 2]
    force[0, 2] = p[1] * error + p[2] * s[0] - p[3] * v[0, 2]
    rate[0] = error


def controlled_arm():
    gains = (TARGET, PROPORTIONAL, INTEGRAL, DERIVATIVE)
    return fb.Mechanism(
        bodies={"arm": fb.RigidBody.bar(**ARM)},
        joints={"pin": fb.Revolute("arm.start", (0.0, 0.0))},
        loads={
            "gravity": fb.Gravity(),
            "motor": fb.ForceLaw(["arm"], pid, gains, states={"integral": 0.0}),
        },
        sensors={
            "angle": fb.Angle("arm"),
            "integral": fb.LawState("motor", "integral", "rad s"),
        },
    )


def motion():
    return fb.simulate(controlled_arm(), duration=6.0, step=2e-3)


def picture(drawing, plot):
    fb.draw(controlled_arm(), axes=drawing)
    result = motion()
    plot.plot(result.time, result.sel(output="angle"), color="#1f78b4", label="angle [rad]")
    plot.plot(result.time, result.sel(output="integral"), color="#d95f02", label="integral [rad s]")
    plot.axhline(TARGET, color="0.6", linewidth=0.8)
    plot.set(xlabel="time [s]")
    plot.legend()
