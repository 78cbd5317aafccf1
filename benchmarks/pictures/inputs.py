"""Draw the pictures of docs/how-to/inputs.md (`make inputs`): one for each kind of input.

A kind is a function that draws on axes, with the name of its picture. Given names, it draws these.
"""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy import stats

import flexband as fb
from flexband.uncertainty.inputs.distributions.scipy_distribution import as_input
from flexband.uncertainty.inputs.space import Space

IMAGES = Path(__file__).parents[2] / "docs" / "images" / "inputs"
LOOK = {"font.size": 8.0, "legend.frameon": False, "svg.hashsalt": "flexband"}
COLOUR = "#3b6ea5"
MARKED = "#c0392b"
MEASURED = np.random.default_rng(3).gamma(20.0, 0.25, 40)


def density(distribution: fb.Distribution, label: str) -> Callable[[Axes], None]:
    """Return a function that draws the density, the nominal value, and the first nested points."""

    def draw(axes: Axes) -> None:
        z = np.linspace(-4.0, 4.0, 2001)
        x = distribution.at_normal(z)
        middle = (x[1:] + x[:-1]) / 2
        slope = np.diff(x) / np.diff(z)
        height = np.exp(-(((z[1:] + z[:-1]) / 2) ** 2) / 2) / np.sqrt(2 * np.pi) / slope
        inner_mask = (middle > x[50]) & (middle < x[-50])
        axes.fill_between(middle[inner_mask], height[inner_mask], color=COLOUR, alpha=0.3, lw=0)
        axes.plot(middle[inner_mask], height[inner_mask], color=COLOUR)
        points = distribution.value(distribution.family.sequence(5)[:, None])
        axes.plot(points, 0 * points, "o", color=MARKED, ms=4, clip_on=False, label="runs")
        axes.axvline(points[0], color=MARKED, lw=0.8, ls=":")
        if isinstance(distribution, fb.Samples):
            axes.plot(
                distribution.values,
                0 * MEASURED - 0.03 * height.max(),
                "k|",
                ms=5,
                label="measured",
            )
        axes.set(xlabel=label, yticks=[], ylim=(-0.06 * height[inner_mask].max(), None))

    return draw


def interval(axes: Axes) -> None:
    """Draw an interval around its nominal value."""
    length = fb.Interval.around(10.0, plus=0.1, minus=0.05)
    axes.plot([length.lower, length.upper], [0, 0], color=COLOUR, lw=6, solid_capstyle="butt")
    axes.plot([length.lower, length.upper], [0, 0], "o", color=MARKED, ms=4)
    axes.set(xlabel="length [mm]", yticks=[], ylim=(-1, 1))


def correlation(axes: Axes) -> None:
    """Draw samples of two springs of one batch."""
    spring = fb.LogNormal(40.0, cv=0.08)
    space = Space({"springs": fb.Correlated({"front": spring, "rear": spring}, 0.8)})
    xi = np.random.default_rng(0).standard_normal((400, 2))
    values = space.values(xi, np.zeros((400, 0)))
    axes.plot(values["front"], values["rear"], ".", color=COLOUR, ms=2)
    axes.set(xlabel="front spring [kN/m]", ylabel="rear [kN/m]")


def p_box(axes: Axes) -> None:
    """Draw distribution functions of a normal whose mean is an interval."""
    x = np.linspace(45.0, 55.0, 301)
    low, middle, high = (fb.Normal(mean, 1.0).frozen.cdf(x) for mean in (48.0, 50.0, 52.0))
    axes.fill_between(x, low, high, color=COLOUR, alpha=0.3, lw=0)
    axes.plot(x, middle, color=MARKED, lw=0.8, ls=":")
    axes.set(xlabel="Normal(Interval(48, 52), 1)", ylabel="probability", ylim=(0, 1))


def choice(axes: Axes) -> None:
    """Draw the bands of a response with either option, and those over both."""
    t = np.linspace(0.0, 1.0, 101)
    rate = {"steel": 1.0, "aluminium": 2.5}

    def response(material, load):
        decay = np.array([rate[name] for name in material])
        return load[:, None] * np.exp(-decay[:, None] * t)

    inputs = {"material": fb.Choice(*rate), "load": fb.Interval(0.9, 1.1)}
    bands = fb.propagate(response, inputs, fb.ImprovedPCCI(1, 2))
    for option, color in zip(rate, (COLOUR, MARKED), strict=True):
        option_bands = bands["mean_by_choice"].sel(choice=option)
        axes.fill_between(t, *option_bands, color=color, alpha=0.4, label=option, lw=0)
    axes.plot(t, bands["mean"].T, color="0.1", lw=0.9)
    axes.legend()
    axes.set(xlabel="time [s]", ylabel="bands")


def realizations(field: fb.RandomField | fb.IntervalField, label: str) -> Callable[[Axes], None]:
    """Return a function that draws some realizations of a field."""

    def draw(axes: Axes) -> None:
        x = np.linspace(0.0, 0.4, 161)
        if isinstance(field, fb.IntervalField):
            axes.fill_between(x, *field.limits(x), color=COLOUR, alpha=0.2, lw=0)
        axes.plot(x, field.realizations(x, 6, 0).T, color=COLOUR, lw=0.8)
        axes.set(xlabel="position [m]", ylabel=label)

    return draw


KINDS: dict[str, Callable[[Axes], None]] = {
    "interval": interval,
    "normal": density(fb.Normal(210.0, cv=0.05), "E [GPa]"),
    "uniform": density(fb.Uniform(0.0, 30.0), "phase [°]"),
    "lognormal": density(fb.LogNormal(5.0, cv=0.4), "k [kN/m]"),
    "truncated_normal": density(fb.TruncatedNormal(1.0, 0.5, lower=0.4), "gap [mm]"),
    "triangular": density(fb.Triangular(0.1, 0.15, 0.4), "friction"),
    "beta": density(fb.Beta(2.0, 5.0, 60.0, 90.0), "load angle [°]"),
    "weibull": density(fb.Weibull(320.0, 8.0), "strength [MPa]"),
    "gumbel": density(fb.Gumbel(25.0, cv=0.15), "wind of a year [m/s]"),
    "scipy": density(as_input(stats.skewnorm(5.0, loc=2.0, scale=0.4)), "mass [kg]"),
    "samples": density(fb.Samples(MEASURED), "c [N·s/m]"),
    "correlated": correlation,
    "p_box": p_box,
    "choice": choice,
    "random_field": realizations(fb.RandomField(69.0, 3.5, 0.1, (0.0, 0.4)), "E [GPa]"),
    "rough_field": realizations(
        fb.RandomField(
            69.0, 3.5, 0.1, (0.0, 0.4), tolerance=0.1, correlation=fb.fields.exponential
        ),
        "E [GPa]",
    ),
    "lognormal_field": realizations(
        fb.RandomField(1.0, 0.4, 0.1, (0.0, 0.4), distribution="lognormal"), "damage"
    ),
    "interval_field": realizations(fb.IntervalField(0.9, 1.1, 0.1, (0.0, 0.4)), "height [mm]"),
}
"""What draws each kind, by the name of its picture."""


def draw(names: list[str]) -> None:
    """Draw kinds by name."""
    IMAGES.mkdir(parents=True, exist_ok=True)
    for name in names:
        with rc_context(LOOK):
            figure = Figure(figsize=(3.6, 1.5), layout="constrained")
            axes = figure.add_subplot()
            axes.spines[["left", "right", "top"]].set_visible(False)
            KINDS[name](axes)
            figure.savefig(IMAGES / f"{name}.png", dpi=100, metadata={"Software": None})


if __name__ == "__main__":
    draw(sys.argv[1:] or list(KINDS))
