"""Methods that publications compare, beside those of `flexband` itself."""

from typing import TYPE_CHECKING

from flexband.basics.namespaces import lazy_names

if TYPE_CHECKING:
    from flexband.uncertainty.methods.least_squares import RegressionPCCI as RegressionPCCI
    from flexband.uncertainty.methods.perturbation import (
        PerturbationChebyshev as PerturbationChebyshev,
    )
    from flexband.uncertainty.methods.scanning import SobolScanning as SobolScanning
    from flexband.uncertainty.phase_resolved.method import PhaseResolvedPCCI as PhaseResolvedPCCI
else:
    __all__, __getattr__, __dir__ = lazy_names(__name__, __file__)
