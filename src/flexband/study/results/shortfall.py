"""Why an accuracy is missed, as data; `report.text.advice` has the next thing to do for each."""

from __future__ import annotations

from enum import StrEnum

import xarray as xr

from flexband.study.start_vibrations import of_attributes as start_vibrations_of
from flexband.uncertainty.adaptive.adaptation import StopReason
from flexband.uncertainty.surrogates.bands import BandRecord
from flexband.uncertainty.surrogates.unconverged import of_attributes as unconverged_of
from flexband.uncertainty.surrogates.verification_verdict import Confirmation, VerificationRecord


class Shortfall(StrEnum):
    """A reason why an accuracy is missed."""

    FAILED_RUNS = "failed-runs"
    RINGING = "ringing-from-the-start"
    """A vibration that the start excites, whose phase no expansion follows."""
    SIGMAS = "sigmas"
    """The tolerance is met for μ ± σ, but not for the wider bars that are asked for."""
    KINKS = "kinks"
    """The highest orders are in use, as where a response jumps or has a corner."""
    BUDGET = "budget"
    INTEGRATION = "integration"
    """Moments that no affordable rule integrates."""
    STEP = "step"
    ELEMENTS = "elements"
    RARE_EFFECTS = "rare-effects"
    """Verification runs meet what the runs of the method have not."""


def shortfalls(bands: xr.Dataset, verification: xr.Dataset | None = None) -> list[Shortfall]:
    """Return why an accuracy is missed, what is to be mended first at the front; none if it is met.

    `verification` is the result of `verify`.
    """
    record = BandRecord.read(bands)
    reasons = list[Shortfall]()
    failed = record.runs_failed or record.not_refined
    refuted = (
        verification is not None
        and VerificationRecord.read(verification).confirmed == Confirmation.REFUTED
    )
    # Whether the expansion or the discretization misses its share of the tolerance.
    of_expansion = of_discretization = False
    tolerance = record.tolerance
    if tolerance is not None and record.expansion_error is not None:
        error = record.expansion_error
        discretization_error = record.discretization_error
        automatic_steps = record.halved is not None
        met = record.stop_reason == StopReason.TOLERANCE_MET
        share = tolerance / 2 if automatic_steps else tolerance
        exceeded = record.tolerance_missed if automatic_steps else error > tolerance
        if exceeded and met and record.sigmas != 1:
            return [Shortfall.SIGMAS]
        of_expansion = (
            exceeded and error > share and not (met and bool(unconverged_of(bands.attrs)))
        )
        of_discretization = bool(len(record.refined)) and discretization_error > (
            share if automatic_steps else max(tolerance, error)
        )
    # The reasons, in the order in which they are to be mended.
    if failed and (of_expansion or of_discretization or refuted):
        reasons.append(Shortfall.FAILED_RUNS)
    if start_vibrations_of(bands.attrs) and (of_expansion or of_discretization):
        reasons.append(Shortfall.RINGING)
    elif of_expansion:
        integrated = record.integration_error > (record.expansion_error or 0.0) / 2
        kinks = record.stop_reason == StopReason.ORDERS_USED or record.orders_used is not None
        of_values = Shortfall.KINKS if kinks else Shortfall.BUDGET
        reasons.append(Shortfall.INTEGRATION if integrated else of_values)
    if of_discretization:
        worst = max(record.refined, key=lambda name: bands.attrs[f"{name}_error"])
        reasons.append(Shortfall.ELEMENTS if worst == "elements" else Shortfall.STEP)
    if refuted and not of_expansion:
        reasons.append(Shortfall.RARE_EFFECTS)
    return reasons
