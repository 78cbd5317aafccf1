"""What a surrogate tells beyond bands: quantiles, requirements, sensitivities, cheap tolerances."""

from typing import TYPE_CHECKING

from flexband.basics.namespaces import lazy_names

if TYPE_CHECKING:
    from flexband.analysis.allocation.allocate import allocate as allocate
    from flexband.analysis.allocation.costs import ReciprocalCost as ReciprocalCost
    from flexband.analysis.allocation.grades import Grades as Grades
    from flexband.analysis.derivation import derived as derived
    from flexband.analysis.limits.former_names import check_limits as check_limits
    from flexband.analysis.limits.margins import check_requirements as check_requirements
    from flexband.analysis.p_boxes import p_box as p_box
    from flexband.analysis.parts.horizon import predictability_horizon as predictability_horizon
    from flexband.analysis.parts.sampling import sample_parts as sample_parts
    from flexband.analysis.paths import path as path
    from flexband.analysis.probability.failure import failure_probability as failure_probability
    from flexband.analysis.quantile_bounds import quantiles as quantiles
    from flexband.analysis.quantities import (
        Final as Final,
        Magnitude as Magnitude,
        Peak as Peak,
        PeakTime as PeakTime,
        RootMeanSquare as RootMeanSquare,
        Spectrum as Spectrum,
        Trough as Trough,
    )
    from flexband.requirements.criteria import (
        Probability as Probability,
        ShareOfParts as ShareOfParts,
        WorstCase as WorstCase,
    )
    from flexband.requirements.scatter import Capability as Capability
    from flexband.analysis.resampling import OverOutput as OverOutput
    from flexband.analysis.sensitivity.contributions import contributions as contributions
    from flexband.analysis.sensitivity.sobol import sobol_indices as sobol_indices
    from flexband.analysis.sensitivity.tolerance_for import tolerance_for as tolerance_for
    from flexband.analysis.value_ranges import value_range as value_range
else:
    __all__, __getattr__, __dir__ = lazy_names(__name__, __file__)
