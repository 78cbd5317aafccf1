"""Draw every example and write docs/how-to/gallery.md (`make gallery`).

An example has a function `picture(drawing, plot)`, which draws the mechanism on the first axes and
results on the second. The first line of its docstring is the title of its section, the paragraph
below is the text. Given names of examples, it draws these only.
"""

import runpy
import sys
from pathlib import Path
from types import SimpleNamespace

from matplotlib import rc_context
from matplotlib.figure import Figure

HERE, DOCS, LINK = Path(__file__).parent, Path(__file__).parents[1] / "docs", "../../examples"
LOOK = {"font.size": 8.0, "lines.linewidth": 1.2, "lines.markersize": 4.0, "legend.frameon": False}
EDGES = {"left": 0.1, "right": 0.92, "bottom": 0.12, "top": 0.94, "wspace": 0.24, "hspace": 0.4}
WIDE = ("slider_crank", "spin_up")  # drawn above the plot instead of beside it
INTRODUCTION = """# Gallery

Mechanisms, each a complete script of at most 60 lines in `examples/`.
`make gallery` draws them and writes this page; `tests/test_examples.py` compares each with an
independent result. Scripts that define `study` also run with `flexband run examples/….py`.
"""


def load(file: Path) -> SimpleNamespace:
    """Run an example and return the names it defines."""
    return SimpleNamespace(**runpy.run_path(str(file)))


def draw(example: SimpleNamespace) -> Figure:
    """Return the picture of an example, 8 by 4 inches."""
    grid = (2, 1) if Path(example.__file__).stem in WIDE else (1, 2)
    with rc_context(LOOK):
        figure = Figure(figsize=(8, 4))
        drawing, plot = figure.subplots(*grid, gridspec_kw=EDGES)
        example.picture(drawing, plot)
        drawing.locator_params(axis="x", nbins=6)
        plot.margins(x=0)
    return figure


def main() -> None:
    """Write the pictures and the page."""
    page, images = [INTRODUCTION], DOCS / "images" / "gallery"
    images.mkdir(parents=True, exist_ok=True)
    for file in sorted(set(HERE.glob("*.py")) - {Path(__file__).resolve()}):
        example = load(file)
        if not sys.argv[1:] or file.stem in sys.argv[1:]:
            draw(example).savefig(images / f"{file.stem}.png", dpi=100)
        title, text = example.__doc__.strip().split("\n\n")[:2]
        page.append(f"## {title.rstrip('.')}\n\n{text} [`{file.name}`]({LINK}/{file.name})\n")
        page.append(f"![{title}](../images/gallery/{file.stem}.png)\n")
    (DOCS / "how-to" / "gallery.md").write_text("\n".join(page), encoding="utf-8")


if __name__ == "__main__":
    main()
