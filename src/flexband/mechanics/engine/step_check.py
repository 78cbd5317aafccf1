"""Remarks on steps in which bodies turn too far, and on vibrations with too few steps per period.

A free vibration of angular frequency ω lags by (ωh)²/12 (1 + 4.5 δ²) of its angle, with
δ = (1 − ρ∞)/(1 + ρ∞), see docs/explanation/theory.md. What vibrates is read off the outputs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from flexband.basics.rounding import Units
from flexband.basics.user_functions import evaluate_function
from flexband.basics.warning import warn
from flexband.errors import ResolutionWarning
from flexband.mechanics.assembly.system import System
from flexband.mechanics.engine.generalized_alpha import GeneralizedAlpha
from flexband.mechanics.kernels.forms import TimeFunction
from flexband.remarks.remark import Remark, RemarkKind


class StepCheck(NamedTuple):
    """Which errors of a step are remarked on, and how vibrations are read off outputs."""

    max_loss: float = 0.01
    """Of a body's speed over a run, or lag of its angle, without a warning."""
    max_error: float = 0.04
    """Of an output's variation, without a remark."""
    target_error: float = 0.01
    """For which a step is recommended."""
    half_width: float = 0.15
    """Of the band about a vibration's frequency, relative to it."""
    contrast: float = 2.0
    """Energy of a vibration's band over that of the bands on either side."""
    min_periods: int = 6
    """Of a vibration in the record."""
    min_times: int = 24
    """In the record."""
    min_swings: float = 1.5
    """To and fro in a run, of a part whose lag adds up over them."""
    min_turns: int = 3
    """Periods in the record of a function of time that forces vibrations."""
    harmonics: int = 12
    """Multiples of its frequency whose vibrations count as forced."""
    window_floor: float = 0.2
    """Where the window is above it, the size of a vibration is known."""
    driven_share: float = 1e-2
    """Of a function's energy that makes a frequency one of its own."""
    min_scale: float = 1e-6
    """Variation of an output over the largest output of the same unit."""
    candidates: int = 4
    """Outputs whose vibrations are followed in time."""

    def edges(self, k: np.ndarray, count: int, power: int) -> np.ndarray:
        """Return the first number of a band about each of k, and the first after it."""
        low = np.maximum(np.floor(k * (1 - self.half_width) ** power), 1)
        high = np.minimum(np.ceil(k * (1 + self.half_width) ** power) + 1, count)
        return np.stack([low, np.maximum(low, high)]).astype(int)


class Vibration(NamedTuple):
    """A vibration that is seen in an output."""

    output: int
    frequency: float  # [Hz]
    lag: float  # phase [rad] at the end
    error: float  # root mean square of the output, relative to its standard deviation
    recommended: float  # steps per period with which the error would be the `target_error`


def warn_of_large_steps(
    turn_statistics: np.ndarray,
    system: System,
    times: np.ndarray,
    integrator: GeneralizedAlpha,
    check: StepCheck = StepCheck(),
) -> None:
    """Warn of the part whose speed is wrong by the most, if it is by more than one per cent.

    To the leading order, a free body that turns by φ in a step loses ((1 − ρ)/(1 + ρ))² φ⁴/8 of its
    speed, and its angle lags behind by φ²/12 of what it turns. `turn_statistics` are those of
    `WorkSpace`.
    """
    if not turn_statistics.size:
        return
    rho = float(integrator.spectral_radius)
    count = len(times) - 1
    _warn_of_swings(turn_statistics, system, count, rho, check)
    fourth_powers = turn_statistics[..., 0]
    loss = -np.expm1(-(((1 - rho) / (1 + rho)) ** 2) * fourth_powers / 8)
    angle = (fourth_powers / count) ** 0.25
    lag = angle**2 / 12
    error = np.maximum(loss, lag)

    def text(sample: int) -> str:
        at = sample, int(error[sample].argmax())
        return (
            f"{system.turning[at[1]]} turns by about {angle[at]:.2g} rad per step: numerical "
            f"damping takes about {loss[at]:.2%} of its speed and its angle lags by about "
            f"{lag[at]:.2%}, unless a drive holds it; take a shorter step"
            + (" or a spectral_radius nearer to 1" if loss[at] > check.max_loss else "")
        )

    _warn_of_coarse_steps(error, check.max_loss, text, system)


def _warn_of_swings(
    turn_statistics: np.ndarray, system: System, count: int, rho: float, check: StepCheck
) -> None:
    """Warn of the part whose swings are late by the most, if it is by more than 4 %.

    A part that swings by A cos ωt turns by up to φ = Aωh in a step. To the leading order it lags
    by 3/32 (1 + 3 δ²) φ² of the phase ωt, in addition to what a small vibration lags.
    """
    reach = np.maximum(turn_statistics[..., 2] + turn_statistics[..., 3], 1e-300)
    angle = (turn_statistics[..., 0] / count * 8 / 3) ** 0.25
    phase = count * angle / (reach / 2)
    lag = 3 / 32 * (1 + 3 * ((1 - rho) / (1 + rho)) ** 2) * angle**2 * phase
    lag = np.where(phase > 2 * np.pi * check.min_swings, lag, 0.0)

    def text(sample: int) -> str:
        at = sample, int(lag[sample].argmax())
        return (
            f"{system.turning[at[1]]} swings by about ± {reach[at] / 2:.3g} rad and turns by up to "
            f"{angle[at]:.2g} rad per step: its phase lags by about {lag[at]:.2g} rad at the end, "
            f"unless a drive holds it; a step that is "
            f"{np.sqrt(lag[at] / check.target_error):.2g} times shorter would make it 0.01 rad"
        )

    _warn_of_coarse_steps(lag, check.max_error, text, system)


def _warn_of_coarse_steps(
    error: np.ndarray, limit: float, text: Callable[[int], str], system: System
) -> None:
    """Warn of the worst sample; errors are those of parts, (samples, parts), `limit` is allowed."""
    parts = error.argmax(axis=1)
    largest = error.max(axis=1)
    samples = np.flatnonzero(largest > limit)
    if not samples.size:
        return
    remarks = [
        Remark(
            RemarkKind.COARSE_STEP,
            text(int(k)),
            size=float(largest[k]),
            part=system.turning[parts[k]],
            error=float(largest[k]),
            sample=int(k),
        )
        for k in samples
    ]
    warn(text(int(largest.argmax())), ResolutionWarning, remarks)


def remark_on_few_steps(
    motion: xr.DataArray,
    functions: Sequence[TimeFunction],
    h: float,
    integrator: GeneralizedAlpha,
    check: StepCheck = StepCheck(),
) -> Remark | None:
    """Return which vibration makes an output wrong by most, if it is by more than 4 %.

    A vibration of a frequency that a function of time has, or a multiple of it, counts as forced.
    """
    first = motion.isel(sample=0) if "sample" in motion.dims else motion
    outputs = first.values
    times = first["time"].values
    count = len(times)
    if count < check.min_times or not len(outputs):
        return None
    h = h / 2 if 0 in motion.attrs.get("halved_step", ()) else h
    # Compare with the variation of each output, or with rounding.
    rho = float(integrator.spectral_radius)
    dt = times[1] - times[0]
    size = np.maximum(np.abs(outputs).max(axis=-1), first["unit"].values == "rad")
    units = Units.along(first, ("output",))
    std = outputs.std(axis=-1)
    varies = std > units.least_variation(size, check.min_scale)
    scale = np.maximum(std, units.rounding / check.max_error)  # errors are above rounding
    free_frequencies = np.ones(count // 2 + 1, dtype=bool)
    worst = worst_vibration(outputs, varies, scale, free_frequencies, dt, h, rho, check)
    # Leave out the frequencies of drives only where there is something to report.
    if worst is not None and worst.error > check.max_error:
        values = [[float(np.ravel(evaluate_function(f, t))[0]) for t in times] for f in functions]
        free_frequencies = not_driven(np.array(values).reshape(-1, count), check)
        worst = worst_vibration(outputs, varies, scale, free_frequencies, dt, h, rho, check)
    if worst is None or worst.error <= check.max_error:
        return None
    name = str(first["output"].values[worst.output])
    text = (
        f"output {name!r} vibrates at about {worst.frequency:.3g} Hz, "
        f"with {1 / (worst.frequency * h):.3g} steps per period: its phase lags by about "
        f"{worst.lag:.3g} rad at the end, which is an error of about {worst.error:.0%} of the "
        f"output's variation; {worst.recommended:.0f} steps per period would make it about 1 %"
    )
    error = float(worst.error)
    return Remark(
        RemarkKind.COARSE_STEP, text, size=error, part=name, outputs=(name,), error=error, sample=0
    )


def worst_vibration(
    outputs: np.ndarray,
    varies: np.ndarray,
    scale: np.ndarray,
    free_frequencies: np.ndarray,
    dt: float,
    h: float,
    rho: float,
    check: StepCheck = StepCheck(),
) -> Vibration | None:
    """Return the free vibration with the largest error relative to `scale`, at steps of h and ρ∞.

    The outputs are at times dt apart; `free_frequencies` is whether each may be that of one.
    """
    count = outputs.shape[-1]
    factor = (1 + 4.5 * ((1 - rho) / (1 + rho)) ** 2) / 12
    # Remove the mean and the trend, and find the energy of bands of frequencies.
    tau = np.arange(count) - 0.5 * (count - 1)
    moved = outputs - outputs.mean(axis=-1, keepdims=True)
    moved = moved - (moved @ tau / (tau @ tau))[:, None] * tau
    window = np.hanning(count)
    energy = np.abs(np.fft.rfft(moved * window)) ** 2
    k, band, beside = bands(energy, check)
    omega = 2 * np.pi * k / (count * dt)
    # Estimate the error of each band, that of a vibration that stands out.
    lag = omega * count * dt * factor * (omega * h) ** 2
    tonal = (band > check.contrast * beside) & free_frequencies[k] & varies[:, None]
    weight = np.where(tonal, band * np.minimum(lag / 3**0.5, 2**0.5) ** 2, 0.0)
    total = (window @ window) * count / 2 * np.maximum(scale**2, 1e-300)
    vibrations = []
    error_estimates = np.sqrt(weight.max(axis=-1) / total)
    for o in np.argsort(-error_estimates)[: check.candidates]:
        if error_estimates[o] < check.max_error / 2:
            break
        # Follow the amplitude of the worst band in time.
        at = k[np.argmax(weight[o])]
        peak_band = slice(*check.edges(np.array([at]), energy.shape[-1], 1).ravel())
        frequency = np.average(np.arange(energy.shape[-1])[peak_band], weights=energy[o, peak_band])
        omega = 2 * np.pi * frequency / (count * dt)
        spectrum = np.zeros(count, dtype=complex)
        spectrum[peak_band] = 2 * np.fft.fft(moved[o] * window)[peak_band]
        middle = np.flatnonzero(window > check.window_floor)
        inside = np.clip(np.arange(count), middle[0], middle[-1])
        amplitude = (np.abs(np.fft.ifft(spectrum)) / np.maximum(window, check.window_floor))[inside]
        lag = omega * dt * np.arange(count) * factor * (omega * h) ** 2
        share = amplitude / 2**0.5 / scale[o]
        error = np.sqrt(np.mean((share * 2 * np.sin(np.minimum(lag, np.pi) / 2)) ** 2))
        shorter = np.sqrt(np.sqrt(np.mean((share * lag) ** 2)) / check.target_error)
        steps = 2 * np.pi / (omega * h) * shorter
        vibrations.append(Vibration(int(o), omega / (2 * np.pi), float(lag[-1]), error, steps))
    return max(vibrations, key=lambda vibration: vibration.error, default=None)


def bands(energy: np.ndarray, check: StepCheck) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return numbers of periods, the energy of a band about each, and the larger one beside it."""
    k = np.arange(check.min_periods, energy.shape[-1] - 1)
    total = np.concatenate([np.zeros_like(energy[..., :1]), energy.cumsum(axis=-1)], axis=-1)
    (low, high), (lower, higher) = (check.edges(k, energy.shape[-1], power) for power in (1, 3))
    band = total[..., high] - total[..., low]
    below = total[..., low] - total[..., lower]
    above = total[..., higher] - total[..., high]
    return k, band, np.maximum(below, above)


def not_driven(functions: np.ndarray, check: StepCheck) -> np.ndarray:
    """Return for which frequencies no function, or angle, of shape (functions, times), has 1/m."""
    count = functions.shape[-1]
    window = np.hanning(count)
    series = [functions - functions.mean(axis=-1, keepdims=True), np.exp(1j * functions)]
    free_frequencies = np.ones(count // 2 + 1, dtype=bool)
    for signal in series:
        spectrum = np.abs(np.fft.fft(signal * window)) ** 2
        energy = spectrum[:, : len(free_frequencies)].copy()
        energy[:, 1:] += spectrum[:, -1 : -len(free_frequencies) : -1]
        peaks = energy > check.driven_share * np.maximum(energy.sum(axis=-1, keepdims=True), 1e-300)
        for line in np.flatnonzero(peaks.any(axis=0)):
            if line < check.min_turns:
                continue
            for m in range(1, check.harmonics + 1):
                low, high = check.edges(np.array([line * m]), len(free_frequencies), 1).ravel()
                free_frequencies[low:high] = False
    return free_frequencies
