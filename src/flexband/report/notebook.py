"""Mechanisms drawn in notebooks: ``%load_ext flexband``."""

from __future__ import annotations

from io import BytesIO
from typing import Any

from flexband.errors import InputError, shown
from flexband.mechanics.mechanism import Mechanism
from flexband.report.drawing.draw import draw


def load_ipython_extension(ipython: Any) -> None:
    """Show every `Mechanism` that is the value of a cell as the drawing of `flexband.draw`.

    Parameters
    ----------
    ipython : the running shell, which ``%load_ext flexband`` passes.
    """
    if not hasattr(ipython, "display_formatter"):
        raise InputError(f"ipython must be a running shell; got {shown(ipython)}")
    ipython.display_formatter.formatters["image/png"].for_type(Mechanism, _png)


def _png(mechanism: Mechanism) -> bytes:
    image = BytesIO()
    draw(mechanism).savefig(image, format="png")
    return image.getvalue()
