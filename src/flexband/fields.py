"""Correlations of fields, and the series that fields are expanded into."""

from typing import TYPE_CHECKING

from flexband.basics.namespaces import lazy_names

if TYPE_CHECKING:
    from flexband.uncertainty.inputs.fields.correlation import (
        Matern as Matern,
        exponential as exponential,
        squared_exponential as squared_exponential,
        triangular as triangular,
    )
    from flexband.uncertainty.inputs.fields.eole import eole as eole
    from flexband.uncertainty.inputs.fields.field import Field as Field
    from flexband.uncertainty.inputs.fields.galerkin import (
        karhunen_loeve as karhunen_loeve,
        orthogonal_series as orthogonal_series,
    )
else:
    __all__, __getattr__, __dir__ = lazy_names(__name__, __file__)
