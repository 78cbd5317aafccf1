"""The former name of `Requirement`, which works for one release."""

from __future__ import annotations

from flexband.basics.checks import check_instance
from flexband.basics.former_names import warn_of_former_name
from flexband.requirements.corridors import Bound
from flexband.requirements.requirement import Requirement


def Limit(  # noqa: N802
    output: str | None = None,
    below: Bound = None,
    above: Bound = None,
    during: tuple[float, float] | None = None,
) -> Requirement:
    """Return a `Requirement` that is named after its output; use `Requirement` itself.

    Parameters
    ----------
    output, below, above, during : as in `Requirement`.

    Raises
    ------
    InputError
        If neither `below` nor `above` is given, or one of them is not real and finite.
    """
    warn_of_former_name("flexband.Limit", "flexband.Requirement")
    if output is not None:
        check_instance("Requirement output", output, str, "the name of an output")
    return Requirement(output or "response", output, below, above, during=during)
