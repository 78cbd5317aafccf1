"""Rich displays in notebooks: ``%load_ext flexband``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from html import escape
from io import BytesIO
from typing import Any

from matplotlib.figure import Figure

from flexband.analysis.selection import AnySurrogate
from flexband.basics.user_functions import function_name
from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.mechanics.model.mechanism import Mechanism
from flexband.mechanics.response import MechanismResponse
from flexband.report.drawing.draw import draw
from flexband.report.page.inputs import statistics
from flexband.report.text.numbers import percent
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
        raise InputError(f"ipython must be a running shell; got {value_text(ipython)}")
    formatters = ipython.display_formatter.formatters
    formatters["image/png"].for_type(Mechanism, lambda drawn: figure_png(draw(drawn)))
    formatters["image/png"].for_type(Figure, figure_png)
    for kind in (Input, Choice, Correlated):
        formatters["text/html"].for_type(kind, lambda input_: _inputs({"": input_}))
    formatters["text/html"].for_type(Study, study_html)
    for kind in (Surrogate, SurrogateOfChoices):
        formatters["text/html"].for_type(kind, surrogate_html)


def figure_png(figure: Figure) -> bytes:
    """Return a figure that no window shows."""
    image = BytesIO()
    figure.savefig(image, format="png")
    return image.getvalue()


def study_html(study: Study) -> str:
    """Return a table of a study: its response, method, error bar and inputs."""
    name = function_name(study.response)
    if isinstance(study.source, MechanismResponse):
        name += f" of {function_name(study.source.builder)}"
    bar = "μ ± σ" if study.sigmas == 1 else f"μ ± {study.sigmas:g}σ"
    rows = [("response", name), ("method", _source_text(study.method)), ("error bar", bar)]
    return _table(("study", ""), rows) + _inputs(study.inputs)


def surrogate_html(surrogate: AnySurrogate) -> str:
    """Return a table of a surrogate: its outputs, runs, expected error and inputs."""
    if isinstance(surrogate, SurrogateOfChoices):
        inputs = surrogate.user_inputs
        alternatives = list(surrogate.surrogates.values())
    else:
        inputs = surrogate.space.user_inputs
        alternatives = [surrogate]
    labels = alternatives[0].labels
    sizes = [f"{dim} ({size})" for dim, size in labels.sizes.items() if dim != "sample"]
    rows = [("dims", ", ".join(sizes) or "one number")]
    if "output" in labels.coords:
        rows.insert(0, ("outputs", ", ".join(map(str, labels["output"].values))))
    attrs = [alternative.diagnostics.attrs for alternative in alternatives]
    rows += [(name, str(attrs[0][name])) for name in ("method",) if name in attrs[0]]
    rows.append(("runs", str(sum(int(diagnostics.get("runs", 0)) for diagnostics in attrs))))
    if errors := [about["expected_error"] for about in attrs if "expected_error" in about]:
        averaged = "" if alternatives[0].time is None else f", mean over {alternatives[0].time}"
        width = f"{percent(max(errors))} of the error bar's width{averaged}"
        rows.append(("expected error", width))
    rows += [("not reliable", about["not_trusted"]) for about in attrs if "not_trusted" in about]
    return _table(("surrogate", ""), rows) + _inputs(inputs)


def _inputs(inputs: Mapping[str, Any]) -> str:
    """Return a table of inputs: what each is, and its nominal value and range."""
    rows = [(name, *_about(input_)) for name, input_ in inputs.items()]
    return _table(("input", "", "from", "to", "mean", "std"), rows)


def _about(input_: Any) -> tuple[str, ...]:
    if isinstance(input_, Interval | Sizing | Compensator):
        kind = type(input_).__name__.lower()
        kind += f" ± {input_.tolerance:g}" if isinstance(input_, Sizing) else ""
        return kind, f"{input_.lower:g}", f"{input_.upper:g}", "", ""
    if isinstance(input_, Field):
        numbers = (getattr(input_, name, "") for name in ("mean", "std"))
        words = (f"{moment:.4g}" if isinstance(moment, int | float) else "" for moment in numbers)
        return _source_text(input_), "", "", *words
    if isinstance(input_, Choice | Correlated):
        return repr(input_), "", "", "", ""
    summary = statistics(input_)
    if summary is None:
        return repr(input_), "", "", "", ""
    low, high, mean, std = summary
    words = f"{input_!r}, 90 % of values"
    return words, f"{low:.4g}", f"{high:.4g}", f"{mean:.4g}", f"{std:.3g}"


def _source_text(input_: Any) -> str:
    """Return an object as it would be written: without what is left out, and functions by name."""
    if not is_dataclass(input_):
        return repr(input_)
    repr_fields = [(f, getattr(input_, f.name)) for f in fields(input_) if f.repr]
    changed = [
        (f, value) for f, value in repr_fields if value is not f.default and value != f.default
    ]
    arguments = [f"{f.name}={_name(value)}" for f, value in changed]
    return f"{type(input_).__name__}({', '.join(arguments)})"


def _name(value: Any) -> str:
    return getattr(value, "__qualname__", repr(value))


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    def line(tag: str, cells: Sequence[str]) -> str:
        content = "".join(f'<{tag} style="text-align:left">{escape(c)}</{tag}>' for c in cells)
        return f"<tr>{content}</tr>"

    body = "".join(line("td", row) for row in rows)
    return f"<table>{line('th', header)}{body}</table>"
