"""Studies with known bands, by name: formulas, mechanisms and traps."""

from __future__ import annotations

from collections.abc import Callable

import flexband as fb
from benchmarks.accuracy.formulas import (
    beating,
    bifurcation,
    chirp,
    damped_oscillation,
    fading_carrier,
    formula,
    interior,
    kink,
    onset,
    pulse,
    slow_decay,
    slow_kink,
    two_carriers,
    wave,
)
from benchmarks.accuracy.mechanisms import slider_crank, ten_inputs
from benchmarks.accuracy.references import Case


def cases() -> dict[str, Callable[[], Case]]:
    """Return functions that make the cases, by name."""
    soft = {"E": 6.9e9, "elements": 5}
    wide = {"scatter": 0.05, "tolerance": 0.1}
    return {
        "cos ωt": lambda: formula(wave),
        "damped oscillator": lambda: formula(damped_oscillation),
        "two carriers": lambda: formula(two_carriers),
        "fades and returns": lambda: formula(fading_carrier),
        "no carrier": lambda: formula(slow_decay),
        "slider–crank, ρ∞ = 0.7": slider_crank,
        "slider–crank, ρ∞ = 0.5": lambda: slider_crank(0.5),
        "slider–crank, ρ∞ = 0.8": lambda: slider_crank(0.8),
        "slider–crank, ρ∞ = 1": lambda: slider_crank(1.0),
        "selective element": lambda: slider_crank(integration=fb.sections.SelectiveIntegration()),
        "soft link": lambda: slider_crank(**soft),
        "soft link, displacement": lambda: slider_crank(**soft, displacement=True),
        "wide scatter, ρ∞ = 0.7": lambda: slider_crank(**wide),
        "wide scatter, ρ∞ = 1": lambda: slider_crank(1.0, **wide),
        "four-bar, ten inputs": ten_inputs,
        "chirp (trap)": lambda: formula(chirp),
        "bifurcation (trap)": lambda: formula(bifurcation),
        "independent beating (trap)": lambda: formula(beating),
        "interior extreme (trap)": lambda: formula(interior),
        "kink (trap)": lambda: formula(kink),
        "kink, no carrier (trap)": lambda: formula(slow_kink),
        "pulse (trap)": lambda: formula(pulse),
        "onset (trap)": lambda: formula(onset),
    }
