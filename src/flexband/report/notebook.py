"""Rich displays in notebooks: ``%load_ext flexband``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from html import escape
from io import BytesIO
from typing import Any

from matplotlib.figure import Figure

from flexband.errors import InputError, shown
from flexband.mechanics.mechanism import Mechanism
from flexband.report.drawing.draw import draw
from flexband.report.numbers import percent
from flexband.report.page.inputs import statistics
from flexband.study.study import Study
from flexband.uncertainty.inputs.choices import Choice, Compensator, Sizing
from flexband.uncertainty.inputs.correlated import Correlated
from flexband.uncertainty.inputs.fields.field import Field
from flexband.uncertainty.inputs.inputs import Input, Interval
from flexband.uncertainty.surrogates.choices import SurrogateOfChoices
from flexband.uncertainty.surrogates.surrogate import Surrogate


def load_ipython_extension(ipython: Any) -> None:
    """Show what is the value of a cell: a `Mechanism` as its drawing, others as a table.

    Others are inputs, a `Study` and a surrogate. Figures, as of `draw`, are shown as well.

    Parameters
    ----------
    ipython : the running shell, which ``%load_ext flexband`` passes.
    """
    if not hasattr(ipython, "display_formatter"):
        raise InputError(f"ipython must be a running shell; got {shown(ipython)}")
    formatters = ipython.display_formatter.formatters
    formatters["image/png"].for_type(Mechanism, mechanism_png)
    formatters["image/png"].for_type(Figure, figure_png)
    for kind in (Input, Choice, Correlated):
        formatters["text/html"].for_type(kind, input_html)
    formatters["text/html"].for_type(Study, study_html)
    for kind in (Surrogate, SurrogateOfChoices):
        formatters["text/html"].for_type(kind, surrogate_html)


def mechanism_png(mechanism: Mechanism) -> bytes:
    """Return the drawing of a mechanism."""
    return figure_png(draw(mechanism))


def figure_png(figure: Figure) -> bytes:
    """Return a figure that no window shows."""
    image = BytesIO()
    figure.savefig(image, format="png")
    return image.getvalue()


def input_html(one: Any) -> str:
    """Return a table of one input."""
    return _inputs({"": one})


def study_html(study: Study) -> str:
    """Return a table of a study: its response, method, error bar and inputs."""
    response = study.response
    name = getattr(response, "__qualname__", type(response).__name__)
    if builder := getattr(response, "builder", None):
        name += f" of {_name(builder)}"
    bar = "μ ± σ" if study.sigmas == 1 else f"μ ± {study.sigmas:g}σ"
    rows = [("response", name), ("method", _given(study.method)), ("error bar", bar)]
    return _table(("study", ""), rows) + _inputs(study.inputs)


def surrogate_html(surrogate: Surrogate | SurrogateOfChoices) -> str:
    """Return a table of a surrogate: its outputs, runs, expected error and inputs."""
    if isinstance(surrogate, SurrogateOfChoices):
        given, several = surrogate.given, list(surrogate.surrogates.values())
    else:
        given, several = surrogate.space.given, [surrogate]
    labels = several[0].labels
    sizes = [f"{dim} ({size})" for dim, size in labels.sizes.items() if dim != "sample"]
    rows = [("dims", ", ".join(sizes) or "one number")]
    if "output" in labels.coords:
        rows.insert(0, ("outputs", ", ".join(map(str, labels["output"].values))))
    attrs = [one.diagnostics.attrs for one in several]
    rows += [(name, str(attrs[0][name])) for name in ("method",) if name in attrs[0]]
    rows.append(("runs", str(sum(int(own.get("runs", 0)) for own in attrs))))
    errors = [own["expected_error"] for own in attrs if "expected_error" in own]
    if errors:
        averaged = "" if several[0].time is None else f", mean over {several[0].time}"
        rows.append(
            ("expected error", f"{percent(max(errors))} of the error bar's width{averaged}")
        )
    rows += [("not reliable", own["not_trusted"]) for own in attrs if "not_trusted" in own]
    return _table(("surrogate", ""), rows) + _inputs(given)


def _inputs(given: Mapping[str, Any]) -> str:
    """Return a table of inputs: what each is, and its nominal value and range."""
    rows = [(name, *_about(name, one)) for name, one in given.items()]
    return _table(("input", "", "from", "to", "mean", "std"), rows)


def _about(name: str, one: Any) -> tuple[str, ...]:
    if isinstance(one, Interval | Sizing | Compensator):
        kind = type(one).__name__.lower()
        kind += f" ± {one.tolerance:g}" if isinstance(one, Sizing) else ""
        return kind, f"{one.lower:g}", f"{one.upper:g}", "", ""
    if isinstance(one, Field):
        numbers = (getattr(one, name, "") for name in ("mean", "std"))
        told = (f"{own:.4g}" if isinstance(own, int | float) else "" for own in numbers)
        return _given(one), "", "", *told
    if isinstance(one, Choice | Correlated):
        return repr(one), "", "", "", ""
    found = statistics(name, one)
    if found is None:
        return repr(one), "", "", "", ""
    low, high, mean, std = found
    told = f"{one!r}, 90 % of values"
    return told, f"{low:.4g}", f"{high:.4g}", f"{mean:.4g}", f"{std:.3g}"


def _given(one: Any) -> str:
    """Return an object as it would be written: without what is left out, and functions by name."""
    if not is_dataclass(one):
        return repr(one)
    chosen = [(own.name, getattr(one, own.name)) for own in fields(one) if own.repr]
    usual = {own.name: own.default for own in fields(one)}
    told = [
        f"{name}={_name(value)}"
        for name, value in chosen
        if value is not usual[name] and value != usual[name]
    ]
    return f"{type(one).__name__}({', '.join(told)})"


def _name(value: Any) -> str:
    return getattr(value, "__qualname__", repr(value))


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    def line(tag: str, cells: Sequence[str]) -> str:
        told = "".join(f'<{tag} style="text-align:left">{escape(c)}</{tag}>' for c in cells)
        return f"<tr>{told}</tr>"

    body = "".join(line("td", row) for row in rows)
    return f"<table>{line('th', header)}{body}</table>"
