"""The picture of limits that were checked."""

from __future__ import annotations

from pathlib import Path

from flexband.cli.files import draw
from flexband.cli.messages import print_remark
from flexband.study.results.limits import LimitCheck


def draw_limits(check: LimitCheck, folder: Path) -> None:
    """Draw limits.png in a folder, unless it keeps the limits of its study: a remark says so."""
    from flexband.report.plot.figures import limits_figure  # noqa: PLC0415

    if not check.written:
        print_remark("the report keeps the limits of the study; others must be in its `limits`")
        return
    drawable = check.margins["margin"].ndim <= 2
    figure = folder / "limits.png"
    draw(lambda: limits_figure(check.margins, check.probability), figure, wanted=drawable)
