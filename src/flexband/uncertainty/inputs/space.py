"""The space of standard variables of all inputs, and the response as a function on it."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_triangular

from flexband.basics.checks import check_finite
from flexband.basics.response import Response, ResponseFunction, as_response
from flexband.basics.words import value_text
from flexband.errors import InputError, RunError
from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.expansions.hybrid import tensor_points
from flexband.uncertainty.inputs.choices import Chosen
from flexband.uncertainty.inputs.constants import Constant
from flexband.uncertainty.inputs.correlated import Correlated
from flexband.uncertainty.inputs.distributions.random_option import RandomOption
from flexband.uncertainty.inputs.fields.field import Field, fields_of
from flexband.uncertainty.inputs.inputs import FunctionOfPosition, Input, Interval, Numbers
from flexband.uncertainty.inputs.one_sample import of_one_sample
from flexband.uncertainty.inputs.play import FreePair
from flexband.uncertainty.inputs.unfolding import GivenInput, GivenInputs, first_case, unfold


@dataclass(frozen=True)
class Space:
    """Named inputs and their standard variables, in the order of the names.

    Results therefore do not depend on the order in which the inputs are given.
    """

    user_inputs: GivenInputs  # also numbers, correlated inputs, and parametric p-boxes

    @cached_property
    def inputs(self) -> dict[str, Input]:
        """Inputs that have variables of their own, by name, as of `unfold`; and constants."""
        return unfold(self.user_inputs)

    @cached_property
    def constants(self) -> dict[str, Constant]:
        """The inputs whose value is known."""
        return {name: i for name, i in self.inputs.items() if isinstance(i, Constant)}

    @property
    def uncertain(self) -> dict[str, Input]:
        """All inputs but constants."""
        return {name: i for name, i in self.inputs.items() if name not in self.constants}

    @property
    def design_inputs(self) -> dict[str, Chosen]:
        """The inputs that are chosen and not uncertain."""
        return {name: i for name, i in self.inputs.items() if isinstance(i, Chosen)}

    @property
    def groups(self) -> dict[str, Correlated]:
        """The inputs that depend on each other, as they are given."""
        return {name: i for name, i in self.user_inputs.items() if isinstance(i, Correlated)}

    @property
    def dependent_names(self) -> set[str]:
        """The names of inputs that depend on others."""
        return {name for group in self.groups.values() for name in group.inputs}

    @cached_property
    def arguments(self) -> list[str]:
        """The names of the response's arguments: the inputs without those that are parameters."""
        return [name for name in self.inputs if name not in self.parameters]

    @cached_property
    def parameters(self) -> dict[str, Interval]:
        """The intervals that are parameters of other inputs."""
        return {
            f"{name}.{parameter}": interval
            for name, input_ in self.inputs.items()
            for parameter, interval in input_.intervals.items()
        }

    def of_kind(self, *, random: bool) -> dict[str, Input]:
        """Return the random or the interval inputs."""
        uncertain = {name: i for name, i in self.inputs.items() if i.dimension}
        return {name: i for name, i in uncertain.items() if i.random == random}

    def owners(self, *, random: bool) -> list[str]:
        """Return the name of the input of each variable ξ or η."""
        inputs = self.of_kind(random=random).items()
        return [name for name, input_ in inputs for _ in range(input_.dimension)]

    def columns(self, *, random: bool) -> dict[str, int]:
        """Return the number of the first variable ξ or η of each random or interval input."""
        owners = self.owners(random=random)
        return {name: owners.index(name) for name in dict.fromkeys(owners)}

    @property
    def random_dimension(self) -> int:
        """Number n of variables ξ."""
        return len(self.owners(random=True))

    @property
    def interval_dimension(self) -> int:
        """Number m of variables η."""
        return len(self.owners(random=False))

    @property
    def plays(self) -> dict[str, FreePair]:
        """The pairs of numbers that a clearance leaves free."""
        return {name: i for name, i in self.inputs.items() if isinstance(i, FreePair)}

    @property
    def discs(self) -> tuple[int, ...]:
        """The number of the first η of each pair that is in a disc."""
        columns = self.columns(random=False)
        plays = self.plays.items()
        return tuple(columns[name] for name, pair in plays if pair.in_disc)

    @property
    def families(self) -> tuple[Family, ...]:
        """The polynomials of each variable ξ."""
        return tuple(self.inputs[name].family for name in self.owners(random=True))

    def groups_of_options(self, xi: np.ndarray) -> list[np.ndarray]:
        """Return the numbers of runs at ξ (runs, n) that have the same random options."""
        columns = self.columns(random=True)
        options = [columns[k] for k, i in self.inputs.items() if isinstance(i, RandomOption)]
        if not options:
            return [np.arange(len(xi))]
        _, group = np.unique(xi[:, options], axis=0, return_inverse=True)
        return [np.flatnonzero(group.ravel() == k) for k in range(group.max(initial=-1) + 1)]

    @property
    def advice_on_fields(self) -> str:
        """Which methods take fields of many terms, as a sentence to append; "" without fields."""
        fields = fields_of(self.of_kind(random=True))
        if not fields:
            return ""
        terms = " and ".join(f"{name} has {field.dimension}" for name, field in fields.items())
        return (
            f". Of the random variables, {terms}; LHSScanning, SobolScanning and MonteCarlo take "
            "any number of them"
        )

    @cached_property
    def factor(self) -> np.ndarray | None:
        """L of z = L ξ for correlated inputs, and 1 for the others; None if there are none."""
        if not self.groups:
            return None
        owners = self.owners(random=True)
        factor = np.eye(len(owners))
        for group in self.groups.values():
            indices = [owners.index(name) for name in group.members]
            factor[np.ix_(indices, indices)] = group.factor
        return factor

    def nominal(self) -> tuple[np.ndarray, np.ndarray]:
        """Return ξ = 0 and η = 0, shapes (1, n) and (1, m): the nominal values of all inputs."""
        return np.zeros((1, self.random_dimension)), np.zeros((1, self.interval_dimension))

    def values(self, xi: np.ndarray, eta: np.ndarray) -> dict[str, np.ndarray | FunctionOfPosition]:
        """Return the inputs' values for ξ of shape (runs, n) and η of shape (runs, m)."""
        pairs = self._inputs_at(xi, eta).items()
        return {name: input_.value(standard) for name, (input_, standard) in pairs}

    def _inputs_at(self, xi: np.ndarray, eta: np.ndarray) -> dict[str, tuple[Input, np.ndarray]]:
        """Return the inputs at values of their parameters, and their variables, by name."""
        # unlike that of a matrix product, the rounding of a row does not depend on other rows
        scores = xi if self.factor is None else np.einsum("rj,ij->ri", xi, self.factor)
        remaining = {True: scores, False: eta}
        columns = {}
        for name, input_ in self.inputs.items():
            variables = remaining[input_.random]
            columns[name], remaining[input_.random] = np.split(
                variables, [input_.dimension], axis=1
            )
        numbers = {k: interval.value(columns[k]) for k, interval in self.parameters.items()}
        return {
            name: (input_.at(_parameters(name, input_, numbers)), columns[name])
            for name, input_ in self.inputs.items()
        }

    def arguments_at(
        self, xi: np.ndarray, eta: np.ndarray
    ) -> dict[str, np.ndarray | FunctionOfPosition]:
        """Return what the response is called with: values without those of parameters."""
        values = self.values(xi, eta)
        return {name: values[name] for name in self.arguments}

    def on_branch(self, response: Response) -> Response:
        """Return a response whose runs follow that of the nominal inputs by continuity.

        One that fails there is returned as it is: its runs tell what is wrong.
        """
        try:
            return response.on_branch_of(**self.arguments_at(*self.nominal()))
        except Exception:  # whatever a user's builder raises
            return response

    def numbers_at(self, xi: np.ndarray, eta: np.ndarray) -> dict[str, np.ndarray]:
        """Return the values of uncertain numbers and of control points of fields, (runs,) each."""
        numbers: dict[str, np.ndarray] = {}
        for name, (input_, standard) in self._inputs_at(xi, eta).items():
            numbers |= input_.as_numbers(name, standard)
        return numbers

    def recorded_at(self, xi: np.ndarray, eta: np.ndarray) -> dict[str, np.ndarray]:
        """Return `numbers_at`, variables of random fields, and constants, which tell runs apart."""
        run_numbers: dict[str, np.ndarray] = {}
        for name, (input_, standard) in self._inputs_at(xi, eta).items():
            run_numbers |= input_.run_numbers(name, standard)
        return run_numbers

    def standardize(self, values: Mapping[str, Numbers]) -> tuple[np.ndarray, np.ndarray]:
        """Return ξ and η of the inputs' values, shapes (runs, n) and (runs, m).

        Values have shape (runs,) or (); a random field is given by its standard variables, (runs,
        terms), an interval field at its `places`, (runs, places). Constants may be left out;
        misfits raise `InputError`.
        """
        for name, constant in self.constants.items():
            if name in values and np.any(np.asarray(values[name]) != constant.constant):
                text = value_text(values[name])
                raise InputError(f"{name} must be the constant {constant!r}; got {text}")
        values = {k: v for k, v in values.items() if k not in self.constants}
        uncertain = self.uncertain
        if values.keys() != uncertain.keys():
            raise InputError(
                f"values must be given for {', '.join(uncertain) or 'nothing'}; "
                f"got {', '.join(values) or 'nothing'}"
            )
        columns = {}
        for name, input_ in uncertain.items():
            input_at_values = input_.at(_parameters(name, input_, values))
            columns[name] = _standard(name, input_at_values, values[name])
        counts = {len(c) for c in columns.values()} - {1}
        if len(counts) > 1:
            raise InputError(f"values must be equally many; got {sorted(counts)}")
        runs = counts.pop() if counts else 1

        def join_blocks(*, random: bool) -> np.ndarray:
            blocks = [columns[name] for name in self.of_kind(random=random)]
            full_blocks = (np.broadcast_to(c, (runs, c.shape[1])) for c in blocks)
            return np.concatenate([np.zeros((runs, 0)), *full_blocks], axis=1)

        xi = join_blocks(random=True)
        if self.factor is not None:
            xi = solve_triangular(self.factor, xi.T, lower=True).T
        return xi, join_blocks(random=False)


def _parameters(name: str, input_: Input, values: Mapping[str, Numbers]) -> dict[str, Numbers]:
    """Return the values of the parameters of an input that are intervals."""
    return {parameter: values[f"{name}.{parameter}"] for parameter in input_.intervals}


def _standard(name: str, input_: Input, value: ArrayLike) -> np.ndarray:
    """Return the standard variables of values of an input, shape (runs, dimension)."""
    try:
        numbers = check_finite("values", value, "finite", rank=None) if input_.numeric else value
        standard = input_.standard(numbers)  # pyright: ignore[reportArgumentType]
    except (InputError, ValueError, TypeError) as error:
        raise InputError(f"{name}: {error}") from None
    columns = standard.reshape(len(standard) if standard.ndim else 1, -1)
    if columns.shape[1] != input_.dimension:
        raise InputError(f"{name}: values must have shape (n,); got {np.shape(value)}")
    if not np.isfinite(columns).all():
        raise InputError(f"{name}: values must be finite; got {value_text(value)}")
    return columns


def check_no_play(space: Space, name: str) -> None:
    """Raise `InputError` if a disc is among the inputs, for what searches intervals only."""
    if plays := [name for name, pair in space.plays.items() if pair.in_disc]:
        raise InputError(f"{name} does not take a Play: {', '.join(plays)} must be left out")


def check_names(response: ResponseFunction, inputs: GivenInputs) -> None:
    """Raise `InputError` if the response's arguments and the inputs do not match."""
    space = Space(first_case(inputs))
    if not space.uncertain:
        raise InputError(f"inputs must name at least one uncertain input; got {value_text(inputs)}")
    names = space.arguments
    if isinstance(response, np.ufunc):
        ufunc = response.__name__
        arguments = ", ".join(names)
        raise InputError(
            f"response must take every input by name; numpy.{ufunc} takes them by position: write "
            f"lambda {arguments}: np.{ufunc}({arguments})"
        )
    try:
        parameters = inspect.signature(response).parameters.values()
    except (TypeError, ValueError):
        raise InputError(
            f"response must be a function with named arguments; got {response!r}"
        ) from None
    open_ended = any(p.kind is p.VAR_KEYWORD for p in parameters)
    keywords = {
        p.name: p for p in parameters if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)
    }
    unknown_names = [name for name in names if name not in keywords]
    if unknown_names and not open_ended:
        raise InputError(
            f"inputs name {', '.join(unknown_names)}, which the response does not take; "
            f"it takes {', '.join(keywords) or 'nothing'}"
        )
    missing_names = [n for n, p in keywords.items() if p.default is p.empty and n not in names]
    if missing_names:
        raise InputError(f"the response needs {', '.join(missing_names)}, which inputs do not name")


def error_words(error: Exception, inputs: GivenInputs) -> str:
    """Return in words what a response raised; with a `TypeError`, what it is called with."""
    text = f"the response raised {type(error).__name__}: {error}"
    fields = list(fields_of(inputs))
    if not fields or not isinstance(error, TypeError):
        return text
    return (
        f"{text}. {', '.join(fields)}: a field is a function of the position. At positions x of "
        f"shape (points,), {fields[0]}(x) has shape (n, points)"
    )


def locate_fields(
    response: ResponseFunction, inputs: GivenInputs
) -> tuple[dict[str, GivenInput], int]:
    """Return inputs with the range of positions at which the response evaluates each field.

    It is run with fields and random inputs at their means, and intervals at all their ends (one at
    a time if more than four). The number of these runs is returned, 0 if every field has a domain.
    Raise `InputError` if fewer than two positions are evaluated.
    """
    new_inputs = dict(inputs)
    loose_fields = {k: field for k, field in fields_of(inputs).items() if field.domain is None}
    if not loose_fields:
        return new_inputs, 0

    # Functions in place of the fields record the positions.
    positions: dict[str, list[np.ndarray]] = {name: [] for name in loose_fields}

    def nominal(name: str, field: Field) -> FunctionOfPosition:
        def value(x: np.ndarray) -> np.ndarray:
            points = check_finite(f"{name}: positions", x, rank=None)
            positions[name].append(points.ravel())
            nominal_values = field.nominal(np.atleast_2d(points))
            nominal_values = np.broadcast_to(
                nominal_values, (max(runs, len(nominal_values)), nominal_values.shape[1])
            ).copy()
            return nominal_values[:, 0] if points.ndim == 0 else nominal_values

        return value

    # Evaluate the response with the nominal fields at the ends of all intervals.
    case_inputs = first_case(inputs)
    space = Space(
        {name: input_ for name, input_ in case_inputs.items() if name not in loose_fields}
    )
    m = space.interval_dimension
    ends = np.array([-1.0, 1.0])
    eta = tensor_points([ends] * m) if m <= 4 else np.concatenate([np.eye(m), -np.eye(m)])
    means = [family.gauss(1)[0] for family in space.families]
    runs = len(eta)
    values = space.arguments_at(tensor_points(means).repeat(runs, axis=0), eta)
    values |= {name: nominal(name, field) for name, field in loose_fields.items()}
    try:
        response(**values)
    except Exception as error:
        scalar = of_one_sample(as_response(response), values, error)
        if scalar is not None:
            raise scalar from error
        if isinstance(error, RunError | InputError | MemoryError):
            raise
        raise RunError(error_words(error, inputs), {}) from error
    # The domains span all positions.
    for name, field in loose_fields.items():
        x = np.concatenate([np.zeros(0), *positions[name]])
        if not len(x) or np.ptp(x) == 0:
            raise InputError(
                f"{name}: {field.kind} needs a domain=(start, end), since the response evaluates "
                f"it at {f'one position only, {x[0]:g}' if len(x) else 'no position'}"
            )
        new_inputs[name] = field.with_domain((float(x.min()), float(x.max())))
    return new_inputs, runs
