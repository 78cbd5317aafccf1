"""The code of docs/how-to/extending.md, run and held to exact results."""

import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import flexband as fb

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "extending.md"


@pytest.fixture(scope="module")
def page():
    names = {"__name__": "extending"}
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    for block in blocks:
        exec(block, names)
        definition = block[block.index("@dataclass") :] if "@dataclass" in block else ""
        for code in definition.split("@dataclass")[1:]:
            assert len(code.strip().splitlines()) <= 18
    return SimpleNamespace(**names)


def test_joint_and_sensor(page):
    """Of two equal masses at one height one is pushed: both accelerate half as fast."""
    model = fb.Mechanism(
        bodies={k: fb.PointMass(mass=2.0, position=(x, 0.0)) for k, x in (("a", 0), ("b", 3))},
        joints={"level": page.Level("a", "b")},
        loads={"push": fb.Force("a", y=8.0), "pull": fb.Force("b", x=2.0)},
        sensors={"F": fb.Reaction("level"), "a": fb.Position("a"), "d": page.Separation("a", "b")},
    )
    motion = fb.simulate(model, duration=1.0, step=1e-2)
    np.testing.assert_allclose(motion.sel(output="F_Y"), -4.0, rtol=1e-9)
    np.testing.assert_allclose(motion.sel(output="F_X"), 0.0, atol=1e-9)
    t = motion["time"].values
    np.testing.assert_allclose(motion.sel(output="a_Y"), t**2, atol=1e-9)
    np.testing.assert_allclose(motion.sel(output="d"), 3.0 + 0.5 * t**2, atol=1e-9)


def test_joint_that_says_what_it_holds(page):
    """Atwood's machine; a rope that is taut from 0.1 s on makes up for the time before."""
    pulley = page.Pulley("a", "b")
    for joint in (pulley, fb.contact.Switched(pulley, lambda t: t > 0.1)):
        model = fb.Mechanism(
            bodies={"a": fb.PointMass(mass=2.0), "b": fb.PointMass(mass=3.0, position=(1.0, 0.0))},
            joints={"rope": joint},
            loads={"gravity": fb.Gravity()},
            sensors={"a": fb.Velocity("a"), "F": fb.Reaction("rope")},
        )
        end = fb.simulate(model, duration=0.3, step=0.05)[:, -1]
        np.testing.assert_allclose(end.sel(output="F_Y"), 2 * 6 / 5 * 9.81, rtol=1e-6)
        np.testing.assert_allclose(end.sel(output="a_Y"), 9.81 / 5 * 0.3, rtol=1e-6)


def test_load(page):
    """A mass on a bushing oscillates with ω² = k/m, and its energy stays the same."""
    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=2.0, position=(0.1, 0.0))},
        loads={"support": page.Bushing("m", (0.0, 0.0), 50.0)},
        sensors={"m": fb.Position("m"), "T": fb.KineticEnergy(), "V": fb.PotentialEnergy(),
                 "W": fb.Work("support")},
    )  # fmt: skip
    integrator = fb.GeneralizedAlpha(spectral_radius=1.0)
    motion = fb.simulate(model, duration=2.0, step=1e-3, integrator=integrator)
    np.testing.assert_allclose(
        motion.sel(output="m_X"), 0.1 * np.cos(5.0 * motion["time"]), atol=1e-5
    )
    kinetic, potential, work = (motion.sel(output=name) for name in "TVW")
    np.testing.assert_allclose(kinetic + potential, 0.25, rtol=1e-5)
    np.testing.assert_allclose(kinetic, work, atol=1e-5)


def test_input(page, tmp_path):
    """Mean and standard deviation of an exponential variable are equal."""
    inputs = {"rate": page.Exponential(2.0), "shift": fb.Interval(-1.0, 1.0)}
    surrogate = fb.expand(lambda rate, shift: rate + shift, inputs, fb.PCCI(12, 1))
    bands = surrogate.bands()
    np.testing.assert_allclose(bands["mean"], [1.0, 3.0], rtol=1e-4)
    np.testing.assert_allclose(bands["error_bar"], [-1.0, 5.0], rtol=1e-3, atol=2e-3)
    fb.save_surrogate(surrogate, tmp_path / "own.npz")
    copy = fb.load_surrogate(tmp_path / "own.npz")
    assert copy.space.inputs == inputs
    exact = copy.space.inputs["rate"]
    np.testing.assert_allclose(exact.value(exact.standard(np.array([0.1, 7.0]))), [0.1, 7.0])


def test_distribution(page):
    """A Rayleigh variable has the mean s √(π/2) and the standard deviation s √(2 − π/2)."""
    inputs = {"a": page.Rayleigh(fb.Interval(1.0, 2.0))}
    bands = fb.propagate(lambda a: a, inputs, fb.ImprovedPCCI(1, 1))
    mean = np.sqrt(np.pi / 2)
    std = np.sqrt(2 - np.pi / 2)
    np.testing.assert_allclose(bands["mean"], [mean, 2 * mean], rtol=1e-9)
    np.testing.assert_allclose(bands["error_bar"], [mean - std, 2 * (mean + std)], rtol=1e-9)


def test_methods(page):
    """μ = a and σ = 0.1 (1 + a²) over a ∈ [−1, 1]."""
    inputs = {"a": fb.Interval(-1.0, 1.0), "x": fb.Normal(0.0, 0.1)}

    def response(a, x):
        return a + (1 + a**2) * x

    for method, tolerance in ((page.LobattoPCCI(2, 2), 1e-9), (page.HaltonScanning(256, 5), 0.01)):
        bands = fb.propagate(response, inputs, method)
        np.testing.assert_allclose(bands["mean"], [-1.0, 1.0], atol=tolerance)
        np.testing.assert_allclose(bands["error_bar"], [-1.2, 1.2], atol=tolerance)
        space = fb.expand(response, inputs, fb.PCCI(1, 1)).space
        assert bands.attrs["runs"] == method.runs(space) + 1  # one run is made again
