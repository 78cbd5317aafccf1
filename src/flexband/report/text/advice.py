"""What to do next where an accuracy is missed: one sentence for every reason."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import xarray as xr

from flexband.basics.words import number_of
from flexband.report.text.numbers import number, percent
from flexband.study.results.shortfall import Shortfall, shortfalls
from flexband.study.start_vibrations import of_attributes
from flexband.uncertainty.surrogates.bands import BandRecord
from flexband.uncertainty.surrogates.unconverged import INTEGRATION, why_not_finer


def advice_on(bands: xr.Dataset, verification: xr.Dataset | None = None) -> list[str]:
    """Return why an accuracy is missed and what to do, or a vibration that the start excites."""
    attrs = bands.attrs
    lines = list[str]()
    reasons = shortfalls(bands, verification)
    if Shortfall.RINGING not in reasons and of_attributes(attrs):
        lines.append(_ringing_text(attrs))
    for reason in reasons:
        lines.append(SENTENCES[reason](attrs))
        if reason in (Shortfall.BUDGET, Shortfall.KINKS):
            lines.append(f"The largest prediction error is {attrs['largest_miss']}")
    return lines


Attributes = Mapping[str, Any]


def _of_expansion(attrs: Attributes) -> str:
    default_advice = "allow more runs (--max-runs)"
    return f"{_unmet(attrs)} NOT met: {BandRecord.read(attrs).advice or default_advice}"


def _of_discretization(attrs: Attributes, remedy: str) -> str:
    if "halved" in attrs:
        return f"{_unmet(attrs)} NOT met by the discretization: {why_not_finer(attrs)}"
    left_out = ", or omit step and elements to let flexband choose them"
    return (
        "The discretization is coarse: a finer one would move the bands by more than the "
        f"tolerance; give {remedy}{left_out * ('step' in attrs['refined'])}"
    )


def _ringing_text(attrs: Attributes) -> str:
    worst = of_attributes(attrs)[0]
    return (
        f"{worst.output or 'The response'} vibrates at {worst.frequency:.3g} Hz from the start, by "
        f"up to {percent(worst.share)} of the band's width"
    )


def _of_start(attrs: Attributes) -> str:
    return (
        f"{_unmet(attrs)} NOT met: {_ringing_text(attrs)}; start smoothly (fb.ramp for drives, "
        "start='static' or start='periodic'), or let requirements begin after it has decayed"
    )


def _of_failures(attrs: Attributes) -> str:
    failed = BandRecord.read(attrs).runs_failed
    lost = f"{number_of(failed, 'run')} failed" if failed else "Finer runs fail"
    return f"{lost}: correct the model there, or narrow the ranges; `flexband status` says why"


def _of_sigmas(attrs: Attributes) -> str:
    bars = f"μ ± {number(attrs['sigmas'])}σ"
    return f"{_unmet(attrs)} met for μ ± σ, but NOT for {bars}: choose a smaller one (--tolerance)"


def _of_rare_effects(attrs: Attributes) -> str:
    return (
        "Verification runs found an effect that the other runs missed: study the ranges where it "
        "occurs separately, or use a method that needs no smoothness (--method lhs-scanning)"
    )


def _unmet(attrs: Attributes) -> str:
    return f"The tolerance of {number(100 * attrs['tolerance'])} % is"


SENTENCES: dict[Shortfall, Callable[[Attributes], str]] = {
    Shortfall.FAILED_RUNS: _of_failures,
    Shortfall.RINGING: _of_start,
    Shortfall.SIGMAS: _of_sigmas,
    Shortfall.KINKS: _of_expansion,
    Shortfall.BUDGET: _of_expansion,
    Shortfall.INTEGRATION: lambda attrs: f"{_unmet(attrs)} NOT met: most is due to {INTEGRATION}",
    Shortfall.STEP: lambda attrs: _of_discretization(attrs, "a shorter step"),
    Shortfall.ELEMENTS: lambda attrs: _of_discretization(attrs, "more elements"),
    Shortfall.RARE_EFFECTS: _of_rare_effects,
}
