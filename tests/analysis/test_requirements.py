"""Requirements: names, units, bands around the nominal, criteria, and what is refused."""

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from flexband.errors import InputError

T = np.linspace(0.0, 1.0, 11)
INPUTS = {"e": fb.Interval(-0.1, 0.3), "x": fb.Normal(0.0, 0.01)}


def angles(e, x):
    """y = sin t + e t + x [rad], and its half as a length [m]."""
    y = np.sin(T) + e[:, None] * T + x[:, None]
    coords = {"output": ["wiper", "s"], "time": T, "unit": ("output", ["rad", "m"])}
    return xr.DataArray(np.stack([y, y / 2], 1), coords, ("sample", "output", "time"))


@pytest.fixture(scope="module")
def surrogate():
    return fb.expand(angles, INPUTS, fb.AdaptivePCCI())


def nominal():
    return angles(np.array([0.1]), np.zeros(1)).isel(sample=0)


def test_a_band_around_the_nominal_is_in_the_unit_of_the_requirement(surrogate):
    """At e = 0.1 ± 0.2, μ ± 3σ is 0.2 t + 0.03 beside the nominal."""
    wiper = fb.Requirement("wiper angle", output="wiper", within=10.0, unit="deg")
    margins = fb.analysis.check_requirements(surrogate, wiper.around(nominal()))
    expected = np.radians(10.0) - 0.2 * T - 0.03
    np.testing.assert_allclose(margins["margin"][0], expected, atol=1e-9)
    assert margins["limit"].values.tolist() == ["wiper angle (nominal ± 10°)"]
    assert margins["verdict"].values.tolist() == ["not kept"]
    assert margins["stated_unit"].values[0] == "deg"
    assert float(margins["stated_scale"][0]) == pytest.approx(np.pi / 180)


def test_each_requirement_has_its_own_multiple_of_the_standard_deviation(surrogate):
    common = {"output": "s", "below": 1000.0, "unit": "mm"}
    requirements = [
        fb.Requirement(f"{k}σ", criterion=fb.analysis.WorstCase(k), **common) for k in (2.0, 5.0)
    ]
    margins = fb.analysis.check_requirements(surrogate, requirements)
    ends = 0.5 * (np.sin(1.0) + 0.3 + 0.01 * np.array([2.0, 5.0]))
    np.testing.assert_allclose(margins["least_margin"], 1.0 - ends, atol=1e-9)
    assert margins["deviations"].values.tolist() == [2.0, 5.0]
    assert "sigmas" not in margins.attrs
    one_sigma = fb.analysis.check_requirements(surrogate, requirements, sigmas=1.0)
    np.testing.assert_allclose(one_sigma["least_margin"], 1.0 - 0.5 * (np.sin(1.0) + 0.31))


def test_with_choices_the_nominal_is_that_of_each_combination():
    def response(e, kind):
        size = np.where(kind == "steel", 1.0, 5.0)
        return (size * (1 + 0.1 * e))[:, None] * np.ones(3)

    inputs = {"e": fb.Interval(-1.0, 1.0), "kind": fb.Choice("steel", "brass")}
    expansion = fb.expand(response, inputs, fb.AdaptivePCCI())
    unit_nominal = xr.DataArray(np.ones(3), dims=expansion.surrogates["steel"].labels.dims[1:])
    requirement = fb.Requirement("near", within=0.4).around(
        {"steel": unit_nominal, "brass": 5 * unit_nominal}
    )
    margins = fb.analysis.check_requirements(expansion, requirement)
    assert float(margins["least_margin"][0]) == pytest.approx(-0.1)  # brass: 0.4 − 5 · 0.1
    assert margins["worst_choice"].values.tolist() == ["brass"]
    likely = fb.Requirement("near", within=0.6).around(
        {"steel": unit_nominal, "brass": 5 * unit_nominal}
    )
    assert fb.analysis.check_requirements(expansion, likely).attrs["kept"] == "kept"


def test_the_words_of_a_requirement():
    curve = fb.Requirement("gap", "gap", above=lambda t: t, during=(0, 0.5))
    assert str(curve) == "gap above a curve from 0 to 0.5"
    full = fb.Requirement("stroke", "x", above=-5, below=5, unit="mm", identifier="REQ-12")
    assert str(full) == "REQ-12 stroke (between -5 and 5 mm)"
    assert str(fb.Requirement("r", "x", within=2, of=7.0, unit="N")) == "r (7 ± 2 N)"
    assert str(fb.Requirement("response", below=1.0)) == "response below 1"
    assert str(fb.Requirement("F_X", below=5.0)) == "F_X below 5"
    assert str(fb.Requirement("wiper angle", below=5.0)) == "wiper angle (below 5)"


def test_a_requirement_without_an_output_is_on_the_one_with_its_name():
    def response(e):
        values = np.stack([e, 10 * e], axis=1)
        return xr.DataArray(values, {"output": ["u", "F"]}, ("sample", "output"))

    surrogate = fb.expand(response, {"e": fb.Interval(0.9, 1.1)}, fb.PCCI(0, 1))
    margins = fb.analysis.check_requirements(surrogate, fb.Requirement("F", below=12.0))
    assert float(margins["least_margin"][0]) == pytest.approx(1.0)
    assert margins["limit"].values.tolist() == ["F below 12"]
    of_other = fb.Requirement("F", output="u", below=12.0)
    margins = fb.analysis.check_requirements(surrogate, of_other)
    assert float(margins["least_margin"][0]) == pytest.approx(10.9)
    with pytest.raises(InputError, match="'G' output must be one of u, F; got None"):
        fb.analysis.check_requirements(surrogate, fb.Requirement("G", below=12.0))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"name": ""}, "Requirement name must be a text; got ''"),
        ({"name": 3.0}, "Requirement name must be"),
        ({}, "Requirement 'w' must have below, above or both, or within; got none"),
        ({"within": 0.5, "below": 1.0}, "either within, or below and above; got both"),
        ({"within": -0.5}, "within must be .*; got -0.5"),
        ({"within": 0.5, "of": "mean"}, "of must be 'nominal' or a bound; got 'mean'"),
        ({"below": 0.5, "of": 3.0}, "of requires within"),
        ({"below": 0.5, "unit": "furlong"}, "unit must be a unit"),
        ({"below": 0.5, "criterion": 3.0}, "criterion must be"),
        ({"below": 0.5, "identifier": 12}, "identifier must be"),
        ({"belwo": 0.5}, "did you mean 'below'"),
    ],
)
def test_what_is_no_requirement_is_refused(options, message):
    with pytest.raises(InputError, match=message):
        fb.Requirement(**{"name": "w", "output": "wiper", **options})


def test_what_does_not_fit_the_response_is_refused(surrogate):
    check = fb.analysis.check_requirements
    wiper = fb.Requirement("w", output="wiper", within=10.0, unit="mm")
    with pytest.raises(InputError, match="'w' unit must be a unit for rad; got 'mm'"):
        check(surrogate, wiper.around(nominal()))
    with pytest.raises(InputError, match="around the nominal response, which only a study knows"):
        check(surrogate, fb.Requirement("w", output="wiper", within=0.1))
    without_unit = fb.expand(lambda e: e, {"e": fb.Interval(0, 1)}, fb.PCCI(0, 1))
    with pytest.raises(InputError, match="'w' unit requires an output with a unit"):
        check(without_unit, fb.Requirement("w", below=2.0, unit="mm"))


@pytest.mark.parametrize("share", [0.0, 1.0, -0.1, np.nan])
@pytest.mark.parametrize("kind", [fb.analysis.Probability, fb.analysis.ShareOfParts])
def test_shares_are_between_0_and_1(kind, share):
    with pytest.raises(InputError, match="at_most must be"):
        kind(at_most=share)


def test_requirements_of_a_study_are_a_tuple():
    requirement = fb.Requirement("r", below=8.0)
    study = fb.Study(lambda e: e, {"e": fb.Interval(0, 1)}, fb.PCCI(0, 1), requirements=requirement)
    assert study.requirements == (requirement,)
    with pytest.raises(InputError, match="requirements must be a Requirement or a list of them"):
        fb.Study(lambda e: e, {"e": fb.Interval(0, 1)}, fb.PCCI(0, 1), requirements=3.0)
