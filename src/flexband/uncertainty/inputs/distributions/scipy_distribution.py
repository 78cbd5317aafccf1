"""Any continuous distribution of `scipy.stats`.

Their quantiles take long: they are computed once, as polynomials on panels.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_numbers
from flexband.errors import InputError
from flexband.uncertainty.inputs.distribution import Distribution, FrozenDistribution, of_scipy
from flexband.uncertainty.inputs.distributions.bounded import Uniform
from flexband.uncertainty.inputs.distributions.normal import LogNormal, Normal
from flexband.uncertainty.inputs.distributions.quantiles import Quantiles
from flexband.uncertainty.inputs.inputs import Input, Interval, Numbers

if TYPE_CHECKING:
    from scipy.stats import rv_continuous

Given = TypeVar("Given")


@frozen(repr=False)
class ScipyDistribution(Distribution):
    """A number with a continuous distribution of `scipy.stats`, which stands in `inputs` itself.

    Parameters
    ----------
    distribution : its name in `scipy.stats`.
    parameters : pairs of a name and a number, or an `Interval`, of its shapes, `loc` and `scale`.

    Raises
    ------
    InputError
        If `scipy.stats` has no such continuous distribution, a parameter is not its own or out of
        its range, or the variance is not finite.
    """

    distribution: str
    parameters: tuple[tuple[str, float], ...] = ()

    def __repr__(self) -> str:
        arguments = ", ".join(f"{name}={value!r}" for name, value in self.parameters)
        return f"scipy.stats.{self.distribution}({arguments})"

    @property
    def name(self) -> str:
        return self.distribution

    @property
    def frozen(self) -> FrozenDistribution:
        return of_scipy(self.distribution)(**dict(self.parameters))

    @property
    def intervals(self) -> dict[str, Interval]:
        return {
            k: value
            for k, value in self._parameters_by_name().items()
            if isinstance(value, Interval)
        }

    def with_parameters(self, parameters: Mapping[str, float | Input]) -> ScipyDistribution:
        new_parameters = self._parameters_by_name()
        new_parameters.update(parameters)
        return ScipyDistribution(self.distribution, tuple(new_parameters.items()))

    def at(self, parameters: Mapping[str, Numbers]) -> ScipyDistribution:
        if not parameters:
            return self
        arrays = {name: np.atleast_1d(value) for name, value in parameters.items()}
        new_parameters = tuple((self._parameters_by_name() | arrays).items())
        return super().at({"parameters": new_parameters})  # pyright: ignore[reportArgumentType]

    def at_normal(self, z: np.ndarray) -> np.ndarray:
        if any(np.ndim(value) for value in self._parameters_by_name().values()):
            return super().at_normal(z)
        z = np.asarray(z, dtype=float)
        low, high = self.quantiles.reach
        values = self.quantiles(np.clip(z, low, high))
        outside = (z < low) | (z > high)
        if np.any(outside):
            values = np.array(values)
            values[outside] = super().at_normal(z[outside])
        return values

    @cached_property
    def quantiles(self) -> Quantiles:
        reaches = 30.0, 20.0, 12.0, 9.0  # else 7, all but 3·10⁻¹² of the values
        return Quantiles.from_function(super().at_normal, next(filter(self._reaches, reaches), 7.0))

    def _reaches(self, reach: float) -> bool:
        """Return whether quantiles are the inverse of probabilities up to a z."""
        z = np.array([-reach, reach])
        with np.errstate(all="ignore"):
            return bool(np.all(np.abs(self.to_normal(super().at_normal(z)) - z) < 1e-6))

    def check(self) -> None:
        """Raise `InputError` if there is no such distribution."""
        arguments = self._parameters_by_name()
        for name, value in arguments.items():
            arguments[name] = float(check_numbers(f"{self.distribution} {name}", value))
        object.__setattr__(self, "parameters", tuple(arguments.items()))
        generator = of_scipy(self.distribution)
        missing = set(_shapes(generator)) - arguments.keys()
        if missing:
            raise InputError(f"{self!r} needs {', '.join(sorted(missing))}")
        frozen_distribution = generator(**arguments)
        if np.isnan(frozen_distribution.support()).any():
            raise InputError(f"{self!r} has parameters out of their range")
        with np.errstate(all="ignore"):
            mean, variance = frozen_distribution.stats("mv")
        if not np.isfinite([mean, variance]).all() or variance <= 0:
            raise InputError(
                f"{self!r} must have a finite variance; its mean is {mean:g}, and its "
                f"variance {variance:g}: the response would have none either"
            )

    def _parameters_by_name(self) -> dict[str, Any]:
        """Return the parameters by name; raise `InputError` if they are not pairs of SciPy's."""
        parameter_names = [*_shapes(of_scipy(self.distribution)), "loc", "scale"]
        pairs = self.parameters if isinstance(self.parameters, tuple) else (self.parameters,)
        for pair in pairs:
            if not isinstance(pair, tuple) or len(pair) != 2 or pair[0] not in parameter_names:
                raise InputError(
                    f"parameters of scipy.stats.{self.distribution} must be pairs of a name, one "
                    f"of {', '.join(parameter_names)}, and a number; got {pair!r}"
                )
        return dict(pairs)


def as_input(value: Given) -> Given | Distribution:
    """Return a frozen `scipy.stats` distribution as an input, if it can be, and others as is."""
    if not type(value).__module__.startswith("scipy.stats."):
        return value
    from scipy import stats  # noqa: PLC0415

    if isinstance(value, stats.rv_continuous | stats.rv_discrete):
        raise InputError(f"{value.name} must have parameters, as scipy.stats.norm(10.0, 0.5) has")
    if not isinstance(value, stats.distributions.rv_frozen):
        return value
    generator = value.dist
    if isinstance(generator, stats.rv_discrete):
        raise InputError(
            f"{generator.name} is discrete; a Choice has an expansion for each of its options"
        )
    if type(vars(stats).get(str(generator.name))) is not type(generator):
        raise InputError(
            f"{generator.name} must be a distribution that scipy.stats has by this name; "
            "Samples take values of any other"
        )
    # Name the arguments, which may be positional.
    names = [*_shapes(generator), "loc", "scale"]
    parameters = {"loc": 0.0, "scale": 1.0}
    parameters |= dict(zip(names, value.args, strict=False)) | value.kwds
    pairs: Any = tuple((name, np.asarray(parameters[name])[()]) for name in names)
    make = (
        _make_distribution if all(np.ndim(value) == 0 for _, value in pairs) else ScipyDistribution
    )
    scipy_input = make(generator.name, pairs)
    # Use the distributions of this package where there is an equal one.
    loc, scale = (dict(scipy_input.parameters)[name] for name in ("loc", "scale"))
    if scipy_input.distribution == "norm":
        return Normal(loc, scale)
    if scipy_input.distribution == "uniform":
        return Uniform(loc, loc + scale)
    if scipy_input.distribution == "lognorm" and loc == 0:
        return LogNormal.of_logarithm(np.log(scale), dict(scipy_input.parameters)["s"])
    return scipy_input


@lru_cache(maxsize=64)
def _make_distribution(
    distribution: str, parameters: tuple[tuple[str, float], ...]
) -> ScipyDistribution:
    """Return a distribution, the same again for the same numbers: quantiles may take seconds."""
    return ScipyDistribution(distribution, parameters)


def _shapes(generator: rv_continuous) -> list[str]:
    return [name.strip() for name in (generator.shapes or "").split(",") if name.strip()]
