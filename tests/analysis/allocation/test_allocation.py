"""Allocated tolerances: closed forms, exhaustive vertices, and a mechanism from the literature."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
import xarray as xr
from scipy.optimize import LinearConstraint, minimize

import flexband as fb
from flexband.analysis.allocation.grades import ISO_286
from flexband.analysis.allocation.grades import SIZES as ROWS

SIZES = {"crank": 53.0, "coupler": 122.0, "rocker": 66.5, "ground": 100.0}
GAMMA = np.radians(np.linspace(95.5, 215.5, 121))
KEPT = fb.Requirement("response", below=0.8, above=-0.8)
LENGTHS = {name: fb.Interval.around(v, tolerance=0.5) for name, v in SIZES.items()}


def generator(crank, coupler, rocker, ground):
    """Return the error [deg] of a four-bar that generates a function of the crank's angle."""
    a, b, c, g = (length[:, None] for length in (crank, coupler, rocker, ground))
    d2 = a * a + g * g - 2 * a * g * np.cos(GAMMA)
    inner = np.arccos((b * b - c * c - d2) / (2 * c * np.sqrt(d2)))
    angle = np.degrees(np.arctan2(-a * np.sin(GAMMA), g - a * np.cos(GAMMA)) + inner)
    target = 76 + 60 * np.sin(0.75 * (GAMMA - np.radians(95.5)))
    return xr.DataArray(
        (angle - target + 180) % 360 - 180, {"angle": np.degrees(GAMMA)}, ("sample", "angle")
    )


def at_vertices(tolerances, nominal=SIZES):
    """Return the largest |error| of the generator at all vertices of a box."""
    signs = np.array(list(product((-1, 1), repeat=4)))
    values = {
        k: nominal[k] + sign * float(t)
        for (k, t), sign in zip(tolerances.items(), signs.T, strict=True)
    }
    return float(np.abs(generator(**values)).max())


@pytest.fixture(scope="module")
def four_bar():
    return fb.expand(generator, LENGTHS, fb.AdaptivePCCI(1e-4))


def linear(a, b):
    """Return 3 a − 2 b at one time, and half of that at another."""
    y = (3 * a - 2 * b)[:, None] * np.array([0.5, 1.0])
    return xr.DataArray(y, {"time": [0.0, 1.0]}, ("sample", "time"))


@pytest.fixture(scope="module")
def plane():
    surrogate = fb.expand(linear, {k: fb.Interval(-1.0, 1.0) for k in "ab"}, fb.PCCI(1, 1))
    return fb.verify(surrogate, linear)


def test_function_generator_is_as_cheap_as_exhaustive_vertices_allow(four_bar):
    allocation = fb.analysis.allocate(four_bar, KEPT, dict.fromkeys(SIZES, 1.0), response=generator)
    tolerances = allocation["tolerance"].to_series()
    assert allocation.attrs["cost"] == pytest.approx(25.92037, abs=2e-3)
    assert tolerances[list(SIZES)].values == pytest.approx(
        [0.1258, 0.1257, 0.3343, 0.1423], abs=5e-4
    )
    assert at_vertices(tolerances.to_dict()) == pytest.approx(0.8, abs=2e-5)
    assert at_vertices(tolerances.to_dict()) <= 0.8
    assert allocation.attrs["confirmed"] == "yes"
    assert allocation.attrs["runs"] + four_bar.diagnostics.attrs["runs"] <= 64
    assert allocation["binding_at"].values.tolist() == [215.5]
    assert allocation["slack"].item() == pytest.approx(0, abs=1e-5)


@pytest.fixture(scope="module")
def sized():
    inputs = {k: fb.Sizing(0.95 * v, 1.05 * v, tolerance=0.5) for k, v in SIZES.items()}
    return fb.expand(generator, inputs | {"ground": LENGTHS["ground"]}, fb.AdaptivePCCI(1e-3))


def test_sizes_of_the_function_generator_that_allow_the_loosest_tolerances(sized):
    # the least cost of a search on the response itself, by differential evolution and then
    # sequential quadratic programming at all vertices, is 17.988
    costs = dict.fromkeys(SIZES, 1.0)
    allocation = fb.analysis.allocate(sized, KEPT, costs, response=generator)
    nominal = SIZES | allocation["size"].to_series().to_dict()
    assert 17.985 < allocation.attrs["cost"] < 18.1
    assert at_vertices(allocation["tolerance"].to_series().to_dict(), nominal) <= 0.8 + 1e-9
    assert allocation.attrs["confirmed"] == "yes"
    assert allocation.attrs["runs"] + sized.diagnostics.attrs["runs"] <= 80
    best_sizes = [nominal[name] for name in ("crank", "coupler", "rocker")]
    assert best_sizes == pytest.approx([52.524, 121.831, 65.706], abs=0.03)
    assert "remark" not in allocation.attrs


def test_limits_that_no_size_keeps(sized):
    # the least largest |error| of any sizes is 0.31707, by differential evolution
    costs = dict.fromkeys(SIZES, 1.0)
    with pytest.raises(
        fb.errors.InputError, match=r"best of which are .*between.* violated by 0.01[678]"
    ):
        fb.analysis.allocate(sized, fb.Requirement("response", below=0.3, above=-0.3), costs)
    feasible = fb.analysis.allocate(
        sized, fb.Requirement("response", below=0.32, above=-0.32), costs, response=generator
    )
    assert feasible.attrs["confirmed"] == "yes"


def valleys(a, b):
    """Return b p(a), where p has a minimum on either side of 0, the lower one uphill."""
    return ((a**4 - 0.5 * a**3 - a**2 + 0.2 * a + 1) * b)[:, None]


@pytest.mark.parametrize("tolerance", [0.0, 0.05])
def test_the_best_of_several_sizes_is_found(tolerance):
    # |b| ≤ t: the largest |y| is t max p, where p has its least largest value within a ± tolerance
    inputs = {"a": fb.Sizing(-1.0, 1.0, tolerance), "b": fb.Interval(-3.0, 3.0)}
    surrogate = fb.expand(valleys, inputs, fb.PCCI(1, 4))
    allocation = fb.analysis.allocate(
        surrogate, fb.Requirement("response", below=1.0), {"b": 1.0}, response=valleys
    )
    a = np.linspace(-1, 1, 20001)
    p = np.max([valleys(a + offset, 1.0)[:, 0] for offset in (-tolerance, tolerance)], axis=0)
    assert allocation["size"].item() == pytest.approx(a[p.argmin()], abs=2e-3)
    assert allocation["tolerance"].item() == pytest.approx(1 / p.min(), rel=5e-5)
    assert allocation.attrs["confirmed"] == "yes"


def test_a_scatter_with_a_free_size():
    # μ + 3σ = p(a) (1 + 3 s) ≤ 1
    inputs = {"a": fb.Sizing(-1.0, 1.0), "b": fb.Normal(1.0, 0.5)}
    surrogate = fb.expand(valleys, inputs, fb.PCCI(1, 4))
    allocation = fb.analysis.allocate(surrogate, fb.Requirement("response", below=1.0), {"b": 1.0})
    p = valleys(np.linspace(-1, 1, 20001), 1.0).min()
    assert allocation["tolerance"].item() == pytest.approx((1 / p - 1) / 3, rel=1e-5)


def test_a_size_that_is_free(sized, tmp_path):
    size = fb.Sizing(1.0, 2.0, tolerance=0.1)
    assert size.value(np.array([[-1.0], [0.0], [1.0]])).tolist() == [0.9, 1.5, 2.1]
    assert size.standard(np.array([0.9, 1.5, 2.1])) == pytest.approx([-1, 0, 1])
    narrow = sized.narrowed(**LENGTHS)
    assert "remark" not in narrow.bands().attrs
    assert sized.bands().attrs["remark"].startswith("over all values of coupler, crank, rocker")
    fb.save_surrogate(sized, tmp_path / "s.npz")
    assert fb.load_surrogate(tmp_path / "s.npz").space.inputs == sized.space.inputs


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((2.0, 1.0), "lower 2 must be below upper 1"),
        ((1.0, 1.0), "lower 1 must be below upper 1"),
        ((1.0, 2.0, -0.1), "tolerance must be zero or positive"),
        ((1.0, np.nan), "Sizing upper"),
    ],
)
def test_refused_sizes(arguments, message):
    with pytest.raises(fb.errors.InputError, match=message):
        fb.Sizing(*arguments)


def test_grades_are_refused_where_a_size_is_free(sized):
    with pytest.raises(
        fb.errors.InputError, match=r"must not be Grades where .* coupler, crank, rocker"
    ):
        fb.analysis.allocate(sized, KEPT, {"crank": fb.analysis.Grades({"fine": (0.1, 1.0)})})


def test_a_linear_analysis_of_the_function_generator_breaks_the_limit():
    nominal = np.array(list(SIZES.values()))
    steps = np.concatenate([np.zeros((1, 4)), 1e-5 * np.eye(4), -1e-5 * np.eye(4)])
    zero, *variations = generator(*(nominal + steps).T).values
    slopes = (np.array(variations[:4]) - variations[4:]).T / 2e-5
    room = 0.8 - np.abs(zero)
    optimum = minimize(
        lambda t: (1 / t).sum(), np.full(4, 0.1), bounds=[(1e-3, 1.0)] * 4, method="SLSQP",
        constraints=LinearConstraint(np.abs(slopes), -np.inf, room), options={"ftol": 1e-12},
    )  # fmt: skip
    assert optimum.fun == pytest.approx(25.715, abs=2e-3)
    assert at_vertices(dict(zip(SIZES, optimum.x, strict=True))) > 0.8025


def test_runs_correct_a_coarse_surrogate(four_bar):
    coarse = fb.verify(fb.expand(generator, LENGTHS, fb.PCCI(1, 1)), generator)
    costs = dict.fromkeys(SIZES, 1.0)
    uncorrected = fb.analysis.allocate(coarse, KEPT, costs)
    assert uncorrected.attrs["confirmed"] == "no runs were made"
    allocation = fb.analysis.allocate(coarse, KEPT, costs, response=generator)
    assert at_vertices(allocation["tolerance"].to_series().to_dict()) <= 0.8 + 1e-9
    assert allocation.attrs["confirmed"] == "yes"
    assert "corrected for the small differences they showed" in allocation.attrs["verdict"]
    assert allocation.attrs["cost"] == pytest.approx(25.920, rel=2e-3)
    error = abs(uncorrected.attrs["cost"] - 25.920)
    assert abs(allocation.attrs["cost"] - 25.920) < error / 5


def test_multipliers_are_what_relaxing_the_limit_saves(four_bar):
    costs = dict.fromkeys(SIZES, 1.0)
    allocation, looser = (
        fb.analysis.allocate(four_bar, fb.Requirement("response", below=above, above=-0.8), costs)
        for above in (0.8, 0.801)
    )
    cost_slope = (allocation.attrs["cost"] - looser.attrs["cost"]) / 1e-3
    assert float(allocation["saving"][0]) == pytest.approx(cost_slope, rel=5e-3)


@pytest.mark.parametrize("costs", [(1.0, 1.0), (4.0, 0.5), (0.1, 9.0)])
def test_one_linear_limit_has_a_closed_form(plane, costs):
    # the least Σ a/t with 3 t_a + 2 t_b ≤ L has t ∝ √(a/|J|)
    a = np.array(costs)
    slope = np.array([3.0, 2.0])
    limit = 0.6
    t = np.sqrt(a / slope) * limit / (slope @ np.sqrt(a / slope))
    allocation = fb.analysis.allocate(
        plane, fb.Requirement("response", below=limit), dict(zip("ab", costs, strict=True))
    )
    assert allocation["tolerance"].values == pytest.approx(t, rel=1e-5)
    assert allocation.attrs["cost"] == pytest.approx((a / t).sum(), rel=1e-5)
    assert allocation["contribution"].values[:, 0] == pytest.approx(slope * t, rel=1e-4)
    # the cost is C/L, so that relaxing saves C/L per unit
    assert allocation["saving"].item() == pytest.approx((a / t).sum() / limit, rel=1e-3)
    assert allocation["binding_inputs"].sel(input=["a", "b"]).values[:, 0] == pytest.approx(
        [t[0], -t[1]], rel=1e-5
    )


def test_the_search_goes_on_where_no_margin_is_near_zero_at_its_start():
    # (3 a − 2 b)³ ≤ L: 3 t_a + 2 t_b = ∛L; the start, by a straight line, is far from the limit
    surrogate = fb.expand(lambda a, b: ((3 * a - 2 * b) ** 3)[:, None],
                          {k: fb.Interval(-1.0, 1.0) for k in "ab"}, fb.PCCI(1, 3))  # fmt: skip
    allocation = fb.analysis.allocate(
        surrogate, fb.Requirement("response", below=8.0), {"a": 3.0, "b": 2.0}
    )
    assert allocation["tolerance"].values == pytest.approx([0.4, 0.4], rel=1e-4)


def test_random_inputs_have_standard_deviations():
    # k √(9 s² + 4 r²) ≤ L with the cost 1/s + 1/r: J² s³ is the same for both
    inputs = {"a": fb.Normal(0.0, 1.0), "b": fb.Normal(0.0, 1.0)}
    surrogate = fb.expand(linear, inputs, fb.PCCI(1, 1))
    allocation = fb.analysis.allocate(
        surrogate,
        fb.Requirement("response", above=-0.6),
        {"a": 1.0, "b": 1.0},
        sigmas=2.0,
        response=linear,
    )
    shape = np.array([9.0, 4.0]) ** (-1 / 3)
    std = shape * 0.3 / np.sqrt(9 * shape[0] ** 2 + 4 * shape[1] ** 2)
    assert allocation["tolerance"].values == pytest.approx(std, rel=1e-4)
    assert allocation["run_margin"].values == pytest.approx([0.0], abs=1e-5)
    assert allocation.attrs["confirmed"] == "yes"


def test_what_runs_show_and_what_the_surrogate_infers_are_told_apart():
    """The end of μ ± 3σ is beyond all values of a wave, which 2.5 bounds at every e."""

    def wave(e, x):
        return (e + np.sin(2 * x + 0.5))[:, None]

    inputs = {"e": fb.Interval(-1.0, 1.0), "x": fb.Normal(0.0, 1.0)}
    surrogate = fb.expand(wave, inputs, fb.PCCI(6, 1))
    limit = fb.Requirement("response", below=2.5)
    allocation = fb.analysis.allocate(surrogate, limit, {"e": 1.0}, response=wave)
    uncorrected = fb.analysis.allocate(surrogate, limit, {"e": 1.0})
    assert allocation["tolerance"].item() == uncorrected["tolerance"].item()
    assert (allocation.attrs["confirmed"], allocation.attrs["runs"]) == ("inferred", 1)
    assert allocation["run_margin"].item() > 1.5 - allocation["tolerance"].item()
    assert (
        "No limit is violated by 1 verification run; that μ ± 3σ meets"
        in allocation.attrs["verdict"]
    )


def test_tolerances_and_scatter_together():
    inputs = {"a": fb.Interval(-1.0, 1.0), "b": fb.Normal(0.0, 1.0)}
    surrogate = fb.expand(linear, inputs, fb.PCCI(1, 1))
    allocation = fb.analysis.allocate(
        surrogate, fb.Requirement("response", below=1.0), {"a": 1.0, "b": 2.0}, sigmas=3.0
    )
    slope = np.array([3.0, 6.0])
    t = np.sqrt(np.array([1.0, 2.0]) / slope)
    assert allocation["tolerance"].values == pytest.approx(t / (slope @ t), rel=1e-4)


def test_the_largest_tolerances_are_enough(plane):
    allocation = fb.analysis.allocate(
        plane, fb.Requirement("response", below=10.0), {"a": 1.0, "b": 1.0}, response=linear
    )
    assert allocation["tolerance"].values.tolist() == [1.0, 1.0]
    assert allocation["saving_at"].values.tolist() == [0.0]
    assert "Nearest" in allocation.attrs["verdict"]
    assert allocation["slack"].item() == pytest.approx(5.0)


def test_a_surrogate_that_is_not_trusted_is_remarked(plane):
    doubtful = replace(plane.with_attrs(not_trusted="response (a kink)"), held_out=None)
    allocation = fb.analysis.allocate(
        doubtful, fb.Requirement("response", below=1.0), {"a": 1.0, "b": 1.0}
    )
    assert allocation.attrs["verdict"].endswith("Not reliable: response (a kink)")


def test_one_tolerance_at_its_largest(plane):
    # b is worth nothing: it takes 2 of 2.5, and a the rest
    allocation = fb.analysis.allocate(
        plane, fb.Requirement("response", below=2.5), {"a": 1e-3, "b": 100.0}
    )
    assert allocation["tolerance"].values == pytest.approx([0.5 / 3, 1.0], rel=1e-5)
    assert allocation["saving"].item() == pytest.approx(1e-3 / (0.5 / 3) ** 2 / 3, rel=1e-3)


def test_infeasible_limits_name_the_instant_and_the_inputs(plane, four_bar):
    with pytest.raises(
        fb.errors.InputError, match=r"violated by 1.4\d* at time 1, because .*: a \(3\)"
    ):
        fb.analysis.allocate(plane, fb.Requirement("response", below=1.6), {"b": 1.0})
    with pytest.raises(
        fb.errors.InputError, match=r"below 0.4 is .* at angle 215.5.*nominal values"
    ):
        fb.analysis.allocate(
            four_bar, fb.Requirement("response", below=0.4), dict.fromkeys(SIZES, 1.0)
        )


@pytest.mark.parametrize(
    ("limit", "costs", "reason"),
    [  # of a + 2 b + x + c + d - c d, nominal 20, with tolerances 1, 1, σ = 0.5, 1, 1
        (20.0, "abxcd", "the response is at the limit with all inputs at their nominal values"),
        (19.0, "abxcd", "as it is with all inputs at their nominal values"),
        (19.0, "abcd", r"by: x \(1.5\); 1 of it with all inputs at their nominal values$"),
        (20.0, "abcd", r"tolerance, by: x \(1.5\)$"),
        (20.5, "abx", "together, and none alone: c, d$"),
        (20.25, {"a": 0.5, "b": 0.5, "x": 0.5, "c": 0.1, "d": 0.1},
         "because of these tolerances: the margin is only 0.25 with"),
    ],
)  # fmt: skip
def test_infeasible_limits_have_a_true_reason(limit, costs, reason):
    inputs = {
        "a": fb.Interval(9.0, 11.0),
        "b": fb.Interval(4.0, 6.0),
        "x": fb.Normal(0.0, 0.5),
        "c": fb.Interval(-1.0, 1.0),
        "d": fb.Interval(-1.0, 1.0),
    }
    sums = fb.expand(lambda a, b, x, c, d: a + 2 * b + x + c + d - c * d, inputs, fb.PCCI(1, 1))
    if isinstance(costs, dict):
        cost_models = {k: fb.analysis.Grades({"fine": (t, 2.0)}) for k, t in costs.items()}
    else:
        cost_models = dict.fromkeys(costs, 1.0)
    with pytest.raises(fb.errors.InputError, match=reason):
        fb.analysis.allocate(sums, fb.Requirement("response", below=limit), cost_models)


def test_without_runs_nothing_is_said_of_a_confirmation_that_failed(plane):
    allocation = fb.analysis.allocate(
        plane, fb.Requirement("response", below=2.5), {"a": 1.0, "b": 1.0}
    )
    assert allocation.attrs["verdict"].endswith("No runs were made to confirm it")


@pytest.mark.parametrize(
    ("costs", "message"),
    [
        ({}, "at least one input"),
        ({"c": 1.0}, "which are a, b; got 'c'"),
        ({"a": -1.0}, "costs: a must be positive"),
        ({"a": lambda t: np.nan}, "costs: a must be a finite number at 1"),
        ({"a": lambda t: 1 / 0}, "costs: a raised an error"),
        ([1.0], "a mapping from names"),
    ],
)
def test_refused_costs(plane, costs, message):
    with pytest.raises(fb.errors.InputError, match=message):
        fb.analysis.allocate(plane, fb.Requirement("response", below=1.0), costs)


def test_grades_are_those_of_an_exhaustive_search(four_bar):
    sizes = [0.02, 0.05, 0.1, 0.2, 0.4]
    rng = np.random.default_rng(5)
    costs = {
        name: fb.analysis.Grades(
            {f"G{k}": (t, c) for k, (t, c) in enumerate(zip(sizes, prices, strict=True))}
        )
        for name in SIZES
        for prices in [np.sort(rng.uniform(1, 20, 5))[::-1]]
    }
    allocation = fb.analysis.allocate(four_bar, KEPT, costs, response=generator)
    best = None
    least_cost = np.inf
    for combination in product(range(5), repeat=4):
        cost = sum(costs[name].costs[k] for name, k in zip(SIZES, combination, strict=True))
        tolerances = {name: sizes[k] for name, k in zip(SIZES, combination, strict=True)}
        if cost < least_cost and at_vertices(tolerances) <= 0.8:
            best = [f"G{k}" for k in combination]
            least_cost = cost
    assert allocation["grade"].sel(name=list(SIZES)).values.tolist() == best
    assert allocation.attrs["cost"] == pytest.approx(least_cost)
    assert allocation.attrs["confirmed"] == "yes"
    assert allocation["slack"].item() > 0


def test_the_table_of_iso_286_follows_its_tolerance_unit():
    """ITn are multiples of i = 0.45 ∛D + 0.001 D, D the mean of a range, rounded."""
    ends = np.array([1.0, *ROWS])
    D = np.sqrt(ends[1:] * ends[:-1])
    unit = 0.45 * np.cbrt(D) + 0.001 * D
    for factor, row in zip((7, 10, 16, 25, 40, 64, 100), ISO_286.values(), strict=True):
        np.testing.assert_allclose(row[1:], factor * unit[1:], rtol=0.07, atol=0.6)
        np.testing.assert_allclose(row[0], factor * unit[0], rtol=0.2)  # rounded up


def test_grades_of_iso_286():
    grades = fb.analysis.Grades.iso_286(53.0, {"IT5": 3.0, "IT11": 1.0}, millimetre=1.0)
    assert grades.grades == {"IT5": (0.0065, 3.0), "IT11": (0.095, 1.0)}
    assert fb.analysis.Grades.iso_286(0.05, {"IT7": 1.0}).tolerances == pytest.approx([12.5e-6])


@pytest.mark.parametrize(
    ("costs", "message"),
    [
        ({"a": fb.analysis.Grades({"fine": (2.0, 1.0)})}, "up to that of the surrogate, 1; got 2"),
        (
            {"a": fb.analysis.Grades({"fine": (0.1, 1.0)}), "b": 1.0},
            "Grades for all inputs or for none",
        ),
    ],
)
def test_refused_grades(plane, costs, message):
    with pytest.raises(fb.errors.InputError, match=message):
        fb.analysis.allocate(plane, fb.Requirement("response", below=1.0), costs)
