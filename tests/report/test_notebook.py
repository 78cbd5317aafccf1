"""What notebooks show."""

from types import SimpleNamespace

import scipy.stats

import flexband as fb


def formatters():
    by_type = {}
    kind = SimpleNamespace(for_type=by_type.__setitem__)
    shell = SimpleNamespace(formatters={"image/png": kind, "text/html": kind})
    fb.load_ipython_extension(SimpleNamespace(display_formatter=shell))
    return by_type


def html(value):
    by_type = formatters()
    return next(by_type[kind] for kind in type(value).__mro__ if kind in by_type)(value)


def test_inputs_are_tables():
    assert "<td" in html(fb.Interval(1.0, 2.0))
    normal = html(fb.Normal(10.0, 2.0))
    for text in ("Normal(mean=10", "6.71", "13.29", ">10<", ">2<"):
        assert text in normal
    pbox = html(fb.Normal(fb.Interval(9.0, 11.0), 1.0))
    assert ">10<" in pbox
    uniform = html(fb.Uniform(0.0, 1.0))
    assert ">0.05<" in uniform
    for quantity in (fb.Choice("<a>", "b"), fb.RandomField(1.0, 0.1, 2.0),
                fb.RandomField(1.0, 0.1, 2.0, domain=(0.0, 1.0)),
                fb.IntervalField(1.0, 2.0, 0.5, domain=(0.0, 1.0)),
                fb.Correlated({"a": fb.Normal(0, 1), "b": fb.Normal(0, 1)}, 0.5)):  # fmt: skip
        assert html(quantity).startswith("<table>")
    field = html(fb.RandomField(2.0, 0.1, 3.0, correlation=fb.fields.exponential))
    assert (
        "RandomField(mean=2.0, std=0.1, correlation_length=3.0, correlation=exponential)" in field
    )
    assert ">2<" in field
    assert "&lt;a&gt;" in html(fb.Choice("<a>", "b"))


def test_studies_and_surrogates_are_tables():
    inputs = {"x": fb.Interval(1.0, 2.0), "s": scipy.stats.norm(3.0, 0.1), "c": 2.0,
              "kind": fb.Choice("thin", "thick")}  # fmt: skip

    def product(x, s, c, kind):
        return x * s * c

    study = fb.Study(product, inputs, fb.AdaptivePCCI(0.1))
    table = html(study)
    for text in ("product", "AdaptivePCCI(tolerance=0.1", "interval", "Choice", "3"):
        assert text in table
    surrogate = html(study.expand())
    for text in ("one number", "AdaptivePCCI", "expected error", "<td style", "Choice"):
        assert text in surrogate
    single = fb.expand(lambda x: x, {"x": fb.Interval(0.0, 1.0)}, fb.PCCI(0, 1))
    assert ">3<" in html(single)  # runs
