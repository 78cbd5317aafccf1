"""Distributions over the parts that are made, against exact ones."""

import numpy as np
import pytest
import xarray as xr
from scipy.stats import beta, norm

import flexband as fb
from flexband.analysis import Final, Peak, ShareOfParts, sample_parts
from flexband.analysis.parts.estimates import first_order, needed_samples, quantiles_of, share_of
from flexband.analysis.parts.part_distribution import margins_of
from flexband.errors import InputError
from tests.analysis.test_production import irwin_hall

TOLERANCES = {"a": fb.Interval(-1.0, 1.0), "b": fb.Interval(-1.0, 1.0)}


def total(a, b):
    return a + b


def test_confidence_intervals_hold_exact_quantiles_as_often_as_they_say():
    """Of 1000 sets of samples; and not more often, as wider ones would."""
    parts = np.array([0.05, 0.5, 0.95])
    normal = np.random.default_rng(0).normal(size=(292, 1000))
    value, low, high = quantiles_of(normal, parts, 0.95, 0)
    exact = norm.ppf(parts)[:, None]
    coverage = ((low <= exact) & (exact <= high)).mean(axis=1)
    assert (coverage >= 0.94).all()
    assert (coverage <= 0.98).all()
    assert value.mean(axis=1) == pytest.approx(exact[:, 0], abs=0.02)


def test_quantiles_of_a_normal_input_are_in_their_intervals():
    sampling = sample_parts(lambda x: x, {"x": fb.Normal(1.0, 2.0)})
    exact = 1.0 + 2.0 * norm.ppf([0.05, 0.5, 0.95])
    assert (sampling["quantile_low"].values[:, 0] <= exact).all()
    assert (exact <= sampling["quantile_high"].values[:, 0]).all()
    assert sampling.attrs["samples"] == sampling.attrs["runs"] == 292


def test_quantiles_of_counts_are_counts():
    sampling = sample_parts(lambda a, b: np.floor(5 * (a + b)), TOLERANCES)
    for name in ("quantile", "quantile_low", "quantile_high"):
        assert (sampling[name] == np.round(sampling[name])).all()
    assert sampling["quantile"].values[1, 0] in (-1.0, 0.0)


@pytest.mark.parametrize(
    ("probabilities", "failing_shares", "accuracy", "count"),
    [
        ([0.5], [], 0.5, 16),
        ([0.05, 0.5, 0.95], [], 0.5, 292),
        ([0.95], [], 0.25, 1168),
        ([0.95], [], 0.999, 74),  # 0.95^n ≤ 0.025 needs 72
        ([0.5], [1e-3], 0.5, 3688),  # 0.999^n ≤ 0.025
    ],
)
def test_the_number_of_samples_follows_from_what_is_asked(
    probabilities, failing_shares, accuracy, count
):
    assert needed_samples(np.array(probabilities), failing_shares, 0.95, accuracy) == count


def test_samples_that_are_too_few_leave_the_ends_open():
    sampling = sample_parts(total, TOLERANCES, samples=71, probabilities=(0.95,))
    assert np.isinf(sampling["quantile_high"].item())
    sampling = sample_parts(total, TOLERANCES, samples=73, probabilities=(0.95,))
    assert np.isfinite(sampling["quantile_high"].item())


@pytest.mark.parametrize(
    ("hits", "count", "low", "high"), [(0, 10, 0.0, 0.3085), (3, 10, 0.0667, 0.6525)]
)
def test_shares_have_the_intervals_of_clopper_and_pearson(hits, count, low, high):
    share = share_of((hits, hits, hits), count, 0.95, 0)
    assert share == pytest.approx((hits / count, low, high), abs=1e-4)
    assert share_of((hits, hits, hits), count - 1, 0.95, 1)[2] > high
    larger_share = share_of((hits + 2,) * 3, count, 0.95, 0)
    assert share_of((hits, hits, hits + 2), count, 0.95, 0) == (*share[:2], larger_share[2])


def test_what_turns_between_the_times_may_leave_the_bounds_there():
    """All of these curves reach 1, and half of them are above 0.95 at one of the times."""
    time = np.linspace(0.0, 1.0, 6)

    def bounce(at):
        curve = 1 - np.abs(time - at[:, None])
        coords = {"output": ["y"], "unit": ("output", ["m"]), "time": time}
        return xr.DataArray(curve[:, None], coords, ("sample", "output", "time"))

    limit = fb.Requirement("y", output="y", below=0.95)
    sampling = sample_parts(bounce, {"at": fb.Interval(0.4, 0.6)}, requirements=limit, samples=200)
    assert sampling["failing"][0] == pytest.approx(0.5, abs=0.06)
    assert sampling["failing_high"][0] == 1.0


def test_the_yield_of_uniform_tolerances_is_that_of_irwin_and_hall():
    limits = [fb.Requirement("response", below=1.0), fb.Requirement("low", above=-1.5)]
    sampling = sample_parts(total, TOLERANCES, samples=4000, requirements=limits)
    exact = irwin_hall(1.5, 2), 1 - irwin_hall(0.25, 2)
    assert sampling["limit"].values.tolist()[-1] == "any limit"
    for k in range(2):
        assert sampling["yield"][k] == pytest.approx(exact[k], abs=0.015)
        assert sampling["yield_low"][k] < exact[k] < sampling["yield_high"][k]
    assert sampling["failing"][2] == pytest.approx(sampling["failing"][:2].sum())
    assert sampling.attrs["verdict"].startswith("response below 1: 8")


def test_a_tolerance_without_a_distribution_is_uniform_and_this_is_said():
    capability = fb.analysis.Capability(cp=1.5)
    sampling = sample_parts(total, TOLERANCES, scatter={"a": capability}, samples=2000)
    assert sampling.attrs["scatter"] == (
        "a: Capability(cp=1.5); b: Uniform(lower=-1.0, upper=1.0), assumed"
    )
    variances = np.array([(2 / 9) ** 2, 1 / 3])
    shares = sampling["first_order"].values[:, 0]
    assert np.abs(shares - variances / variances.sum()).max() < 0.05


def test_requirements_hold_for_peaks_counts_and_windows():
    time = np.linspace(0.0, 1.0, 101)

    def beats(size):
        """A wave; how often it exceeds 1 so far, and its largest value after half the time."""
        wave = size[:, None] * np.abs(np.sin(4 * np.pi * time))
        count = np.cumsum((wave[:, 1:] > 1) & (wave[:, :-1] <= 1), axis=1)
        late = np.maximum.accumulate(np.where(time < 0.5, 0.0, wave), axis=1)
        values = np.stack([wave, np.pad(count, ((0, 0), (1, 0))), late], axis=1)
        coords = {"output": ["wave", "count", "late"], "unit": ("output", ["N", "", "N"])}
        coords |= {"time": time}
        return xr.DataArray(values, coords, ("sample", "output", "time"))

    sampling = sample_parts(
        beats, {"size": fb.Interval(0.5, 1.5)}, samples=1000,
        quantities={"peak": Peak("wave"), "count": Final("count"), "late": Final("late")},
        requirements=[
            fb.Requirement("strength", "peak", below=1.25, unit="N"),
            fb.Requirement("wear", "count", below=0.5, criterion=ShareOfParts(0.6)),
            fb.Requirement("wave", below=1.25), fb.Requirement("late", below=1.0),
        ],
    )  # fmt: skip
    assert sampling["unit"].values.tolist() == ["N", "", "N"]
    assert sampling["quantile"].sel(quantity="peak", probability=0.95) == pytest.approx(
        1.45, abs=0.02
    )
    assert set(sampling["quantile"].sel(quantity="count").values) == {0.0, 4.0}
    assert sampling["yield"].values[:4] == pytest.approx([0.75, 0.5, 0.75, 0.5], abs=0.04)
    extremes = sample_parts(beats, {"size": fb.Interval(0.5, 1.5)}, samples=100)
    assert "largest wave" in extremes["quantity"]
    assert extremes["quantile"].sel(quantity="smallest wave").values == pytest.approx(0, abs=1e-12)


def ishigami(x):
    return np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def test_first_order_indices_are_those_of_ishigami_within_their_errors():
    """Ishigami and Homma: 0.3139, 0.4424, 0; of 100 sets of samples."""
    exact = np.array([0.3139, 0.4424, 0.0])
    coverage_counts = np.zeros(3)
    all_errors = []
    all_indices = []
    for seed in range(100):
        x = np.random.default_rng(seed).uniform(-np.pi, np.pi, (1000, 3))
        indices, errors = (v[:, 0] for v in first_order(x, ishigami(x)[:, None], 0.95))
        coverage_counts += np.abs(indices - exact) <= errors
        all_indices.append(indices)
        all_errors.append(errors)
    assert np.mean(all_indices, axis=0) == pytest.approx(exact, abs=0.01)
    assert (coverage_counts >= 87).all()
    assert np.mean(all_errors, axis=0) == pytest.approx(
        1.96 * np.std(all_indices, axis=0), rel=0.25
    )


def test_first_order_indices_of_a_linear_response_are_shares_of_the_variance():
    inputs = {f"x{k}": fb.Normal(0.0, k + 1.0) for k in range(3)}
    sampling = sample_parts(lambda x0, x1, x2: x0 + x1 + x2, inputs, samples=4000, seed=1)
    shares = sampling["first_order"][:, 0]
    errors = sampling["first_order_error"][:, 0]
    assert (np.abs(shares - np.array([1, 4, 9]) / 14) <= errors).all()
    assert (errors < 0.05).all()


def test_a_number_that_does_not_vary_depends_on_nothing():
    quantities = {"zero": lambda F: 0 * F}
    sampling = sample_parts(total, TOLERANCES, samples=50, quantities=quantities)
    assert (sampling["first_order"] == 0).all()
    assert (sampling["first_order_error"] == 0).all()


def test_samples_in_a_store_survive_a_kill_and_serve_larger_numbers(tmp_path):
    batch_sizes = []

    def response(a, b):
        if len(batch_sizes) >= 3:
            raise KeyboardInterrupt
        batch_sizes.append(len(a))
        return a + b

    def sample(samples):
        return sample_parts(response, TOLERANCES, samples=samples, batch=16, store=tmp_path)

    with pytest.raises(KeyboardInterrupt):
        sample(64)
    first_count = sum(batch_sizes)
    batch_sizes[:] = []
    sampling = sample(48)
    exact = sample_parts(total, TOLERANCES, samples=48)
    assert first_count + sum(batch_sizes) == 48
    xr.testing.assert_equal(sampling, exact)


def test_runs_that_fail_may_have_met_a_requirement_or_not(tmp_path):
    def response(a, b):
        return np.where(a > 0.9, np.nan, a + b)

    limit = fb.Requirement("response", below=1.0)
    sampling = sample_parts(response, TOLERANCES, samples=400, requirements=limit, failed="skip")
    failure_count = sampling.attrs["runs_failed"]
    assert 5 < failure_count < 40
    assert sampling.attrs["samples"] == 400 - failure_count
    complete = sample_parts(total, TOLERANCES, samples=400, requirements=limit)
    assert sampling["failing_low"][0] <= complete["failing_low"][0]
    assert sampling["failing_high"][0] >= complete["failing_high"][0]
    assert sampling["quantile_high"].values[2, 0] >= complete["quantile_high"].values[2, 0]
    assert np.isinf(sampling["quantile_high"].values[2, 0])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"probabilities": (0.5, 0.1)}, "probabilities must increase between 0 and 1"),
        ({"confidence": 1.0}, "confidence must be above 0 and below 1; got 1"),
        ({"accuracy": 0.0}, "accuracy must be above 0 and below 1; got 0"),
        ({"samples": 1}, "samples must be 2 or more"),
        ({"scatter": {"c": fb.Uniform(0.0, 1.0)}}, "a name in scatter must be"),
        ({"scatter": {"a": fb.Uniform(0.0, 5.0)}}, "scatter"),
        ({"scatter": 1.0}, "scatter must be"),
        ({"requirements": fb.Requirement("z", "z", below=1.0)}, "'z' output must be"),
        ({"inputs": {"a": fb.Choice(1.0, 2.0), "b": fb.Interval(0.0, 1.0)}}, "no Choice; got a"),
        (
            {
                "inputs": TOLERANCES
                | {"b": fb.IntervalField(0.0, 1.0, length=1.0, domain=(0.0, 1.0))}
            },
            "scatter is of tolerances",
        ),
    ],
)
def test_bad_arguments_are_refused_by_name(arguments, message):
    with pytest.raises(InputError, match=message):
        sample_parts(total, **({"inputs": TOLERANCES} | arguments))


def test_the_error_of_runs_moves_limits_for_both_ends_of_a_share():
    """Of the levels 0.8, 0.9, 1.1 and 1.2, one is surely above 1 if runs are off by 0.15."""
    levels = xr.DataArray([0.8, 0.9, 1.1, 1.2], dims="sample")
    response = (levels * xr.DataArray(np.ones((1, 4)), dims=("output", "time"))).assign_coords(
        output=["y"]
    )
    numbers = levels.expand_dims({"quantity": ["largest y"]}, -1)
    limits = [fb.Requirement("y", below=1.0), fb.Requirement("largest y", below=1.0)]
    margins = margins_of(limits, response, numbers, "", np.full((1, 4), 0.15))
    np.testing.assert_array_equal((margins < 0).sum(axis=-1), [[1, 2], [2, 2], [3, 2]])


def test_lost_samples_count_for_both_ends_of_a_share():
    """Of 20 samples and 2 lost ones, 3 surely fail, and 5 + 2 possibly: 3 and 7 of 22."""
    share, low, high = share_of((3, 4, 5), 20, 0.95, 2)
    assert share == 0.2
    assert low == pytest.approx(beta.ppf(0.025, 3, 22 - 3 + 1))
    assert high == pytest.approx(beta.ppf(0.975, 7 + 1, 22 - 7))
