"""Discrete inputs: the bands are those over all options, each with an expansion of its own."""

import numpy as np
import pytest

import flexband as fb

MODULUS = {"steel": 210.0, "aluminium": 70.0}
INPUTS = {
    "material": fb.Choice(*MODULUS),
    "layers": fb.Choice(1, 2),
    "length": fb.Interval(1.0, 2.0),
    "load": fb.Normal(5.0, 0.5),
}
TIMES = np.linspace(0.0, 1.0, 5)


def stiffness(material, layers, length, load):
    assert len(set(material)) == 1  # one option at a time
    value = load * np.array([MODULUS[m] for m in material]) * layers / length
    return value[:, None] * (1 + TIMES)


def exact(modulus, length, sigmas):
    return modulus / length * (5.0 + 0.5 * sigmas) * (1 + TIMES)


@pytest.mark.parametrize("method", [fb.AdaptivePCCI(1e-4), fb.ImprovedPCCI(1, 6)])
def test_bands_are_those_over_all_options(method):
    bands = fb.propagate(stiffness, INPUTS, method)
    expected = exact(70.0, 2.0, -1), exact(420.0, 1.0, 1)
    np.testing.assert_allclose(bands["error_bar"], expected, rtol=2e-4)
    assert set(np.ravel(bands["error_bar_choice"][0])) == {"1, aluminium"}
    assert set(np.ravel(bands["error_bar_choice"][1])) == {"2, steel"}
    np.testing.assert_allclose(bands["error_bar_at"][0], [[2.0] * 5, [1.0] * 5])
    means = bands["mean_by_choice"].sel(choice="1, steel")
    np.testing.assert_allclose(means, [exact(210.0, 2.0, 0), exact(210.0, 1.0, 0)], rtol=2e-4)
    assert bands.attrs["runs"] == sum(bands.attrs["choice_runs"])
    assert bands.attrs.get("runs_generic", 8) == 8  # those of one option
    assert "material = Choice('steel', 'aluminium')" in bands.attrs["inputs"]


def test_samples_scan_every_option():
    bands = fb.propagate(stiffness, INPUTS, fb.LHSScanning(200, 2))
    expected = exact(70.0, 2.0, -1), exact(420.0, 1.0, 1)
    np.testing.assert_allclose(bands["error_bar"], expected, rtol=0.01)


def test_the_surrogate_takes_options_and_is_saved(tmp_path):
    surrogate = fb.expand(stiffness, INPUTS, fb.ImprovedPCCI(1, 8))
    fb.save_surrogate(surrogate, tmp_path / "s.npz")
    rows = {
        "material": ["steel", "aluminium", "steel"],
        "layers": [1, 2, 2],
        "length": np.array([1.5, 1.25, 1.0]),
        "load": 5.2,
    }
    one_by_one = zip(rows["material"], rows["layers"], rows["length"], strict=True)
    expected = [stiffness([m], n, x, np.array([5.2]))[0] for m, n, x in one_by_one]
    for expansion in (surrogate, fb.load_surrogate(tmp_path / "s.npz")):
        np.testing.assert_allclose(expansion.evaluate(**rows), expected, rtol=1e-5)
        moments = expansion.moments(material="steel", layers=2, length=1.25)
        np.testing.assert_allclose(moments["mean"][0], exact(420.0, 1.25, 0), rtol=1e-5)
        assert expansion.bands(2.0).equals(surrogate.bands(2.0))
    verification = fb.verify(surrogate, stiffness, runs=4).verification
    assert verification.sizes["choice"] == 4
    assert verification.attrs["runs"] == 16
    with pytest.raises(fb.errors.InputError, match=r"material must be one of Choice\('steel'"):
        surrogate.evaluate(**{**rows, "material": "wood"})
    with pytest.raises(fb.errors.InputError, match="values must be given for layers"):
        surrogate.evaluate(material="steel", length=1.0, load=5.0)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: fb.Choice("a"), "two or more texts, or numbers; got"),
        (lambda: fb.Choice("a", 1), "two or more texts, or numbers; got"),
        (lambda: fb.Choice(1, 2, 1), "must differ"),
        (
            lambda: fb.propagate(stiffness, INPUTS, fb.PCCI(9, 9), most_runs=300),
            "would take 400 runs",
        ),
        (
            lambda: fb.propagate(
                lambda a: np.ones(len(a)), {"a": fb.Choice(1, 2)}, fb.LHSScanning()
            ),
            "at least one uncertain input",
        ),
    ],
)
def test_bad_input_is_refused(call, text):
    with pytest.raises(fb.errors.InputError, match=text):
        call()
