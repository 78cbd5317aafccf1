"""What tests of studies share."""

from pathlib import Path

import pytest
from matplotlib.figure import Figure


@pytest.fixture
def no_drawing(monkeypatch):
    """Write a text in place of every picture, where none is looked at."""

    def write(_, file, **options):
        Path(file).write_bytes(b"a picture")

    monkeypatch.setattr(Figure, "savefig", write)
