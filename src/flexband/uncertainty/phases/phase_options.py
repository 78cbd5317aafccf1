"""How moments of phase expansions are integrated over ξ, and their bounds searched over η."""

from __future__ import annotations

from typing import NamedTuple


class MomentOptions(NamedTuple):
    """The numbers of the rules for smooth moments; compiled loops take them as constants."""

    # blocks of times, and times per block. Early blocks, whose phases have moved little, need fewer
    # points than late ones
    max_blocks: int = 12
    min_block_times: int = 64
    max_rule_points: int = 4000  # of a rule for ξ that resolves the phase
    small_reach: float = 0.2  # phase change [rad] below which Gauss points of the density suffice
    # standard deviations up to which the trapezoidal rule extends: 6e-7 of all values are beyond.
    # Rules of the what-if panel, whose steps are others, agree with those of Python to better than
    # this
    trapezoidal_end: float = 5.0
    # frequency [1/σ] beyond that of the phase that the trapezoidal rule resolves. What it takes for
    # another one is e^{−15} of the whole
    trapezoidal_band: float = 5.5
    # as `trapezoidal_end`, of a normal variable of which ξ is another function without bounds
    far_end: float = 6.0
    # where slopes of phases are looked at: standard deviations along each normal variable and in
    # some directions, and the most η and times per block. Waves farther out have e^{−12.5} of the
    # whole
    slope_distances: tuple[float, ...] = (1.25, 2.5, 3.75, 5.0)
    slope_directions: int = 32
    max_slope_places: int = 9
    max_slope_times: int = 6
    axis_points: int = 5  # of an axis, in Filon's quadrature: the first of a nested sequence
    plane_points: int = 3  # of an axis in a plane
    max_paired_axes: int = 20  # up to so many, all pairs are integrated along saddles: 800 points
    saturated: float = 6.0  # slope [rad/σ] at which the average of e^{iφ} vanishes: e^{−18}
    slope_range: float = 3.0  # standard deviations over which the slope must be large
    newton_steps: int = 4  # towards a saddle
    # largest size of the integrand on a contour, which is |E e^{iψ}| ≤ 1 if ψ is quadratic
    max_integrand: float = 10.0
    # how far the integrand without P, constant if ψ is quadratic, may differ from its mean over a
    # contour: the mean over the points, absolute values of weights. Beyond, the rule is not exact
    # enough
    max_spread: float = 0.1
    samples: int = 8192  # points ξ for phases without a saddle
    # size below which a coefficient of a smooth moment is left out, as a part of the variation of
    # the mean, or of σ²
    negligible_term: float = 1e-6
    max_terms: int = 160  # polynomials for smooth moments, besides those of the parts themselves
    max_powers: int = 40  # of φ̃ in the series of e^{iφ̃}


class PhaseSearchOptions(NamedTuple):
    """The numbers of the search for bounds; compiled loops take them as constants."""

    max_scan_points: int = 2048  # of a grid in η
    scanned_reach: float = 0.3  # phase change [rad] above which a scan has to resolve the waves
    # fraction of the largest coefficient below which that of a smooth moment is dropped
    negligible_coefficient: float = 1e-9
    descents: int = 3  # points of the scan from which an extreme is searched
    max_steps: int = 40  # of a descent
    first_step: float = 0.05  # length of its first step in η
    # a descent ends when a step is expected to gain less than this fraction of the value
    min_relative_gain: float = 1e-9


class SecondRuleOptions(NamedTuple):
    """The rule by which integrated moments are judged."""

    fineness: float = 1.25  # how much denser, and farther into the tails, than the rule in use
    evaluations: int = 4_000_000  # most points ξ times η times outputs times times
    least_points: int = 16_000  # of a product rule that always is affordable
    least_times: int = 12  # at which moments are judged
    places: int = 4  # η between those of bounds
    # points ξ in each of several samples, where a product rule has too many; fewer of many outputs
    samples: int = 8192
    least_samples: int = 1024
    repetitions: int = 4


MOMENTS = MomentOptions()
SEARCH = PhaseSearchOptions()
SECOND_RULE = SecondRuleOptions()
"""Numba takes the fields of global tuples as constants."""
