"""The page docs/evidence/paper.md, from the numbers that are stored."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from benchmarks.paper.statements import (
    of_the_cost,
    of_the_method,
    of_the_reactions,
    of_the_soft_link,
)
from benchmarks.paper.verdicts import Numbers, Statement, cell_of, largest, method, percent

TEMPLATE = Path(__file__).parent / "template.md"


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines) + "\n"


def errors_table(study: Numbers) -> str:
    """Return the errors of all methods of a study."""
    names = list(study["methods"][0]["against truth"])
    rows = []
    for entry in study["methods"]:
        errors = [
            f"{entry['against LHS'][name]:.2g}" if entry["against LHS"] else "" for name in names
        ]
        rows.append(
            [entry["label"], str(entry["runs"]), *errors, f"{largest(entry['against truth']):.2g}"]
        )
    return table(["method", "runs", *names, "converged"], rows)


def sweep_table(numbers: Numbers) -> str:
    """Return the errors with other steps, radii and elements."""
    rows = []
    for cell in numbers["sweep"]:
        errors = [f"{largest(cell[f'improved PCCI {k}']):.2g}" for k in (1, 2, 3)]
        width = sum(widths["error_bar F_X"] for widths in cell["widths"]) / 3
        rows.append([
            cell["element"], f"{1e3 * cell['step']:g}", f"{cell['radius']:g}", *errors,
            f"{largest(cell['PCCI 3']):.2g}", f"{width:.3g}", f"{largest(cell['off']):.0f}",
        ])  # fmt: skip
    width = sum(widths["error_bar F_X"] for widths in numbers["converged"]) / 3
    rows.append(["converged", "0.05", "0.7", "", "", "", "", f"{width:.3g}", ""])
    header = ["element", "step [ms]", "ρ∞", "improved, 16 runs", "81 runs", "256 runs"]
    return table([*header, "PCCI, 256 runs", "width [N]", "off by [%]"], rows)


def statements_table(statements: Sequence[Statement]) -> str:
    """Return statements, what was found, and verdicts."""
    rows = [[statement.claim, statement.result, statement.verdict] for statement in statements]
    return table(["the paper", "here", "verdict"], rows)


def page(numbers: Numbers) -> str:
    """Return the page."""
    stiff = numbers["reactions"]
    soft = numbers["soft link"]
    damped_cell = cell_of(numbers["sweep"], radius=0.5)
    adaptive = method(stiff, "adaptive PCCI (1 %)")
    key_errors = {
        "soft": method(soft, "improved PCCI (2, 2)")["against truth"],
        "stiff": method(stiff, "improved PCCI (2, 2)")["against truth"],
        "last": method(stiff, "improved PCCI (3, 3)")["against truth"],
        "damped": damped_cell["improved PCCI 2"],
        "off": damped_cell["off"],
        "adaptive": adaptive["against truth"],
    }
    fine = [
        largest(cell["improved PCCI 3"])
        for cell in numbers["sweep"]
        if cell["step"] < 3e-4 and cell["radius"] > 0.4
    ]
    statement_functions = of_the_method, of_the_reactions, of_the_soft_link, of_the_cost
    return TEMPLATE.read_text(encoding="utf-8").format(
        **{name: percent(largest(errors)) for name, errors in key_errors.items()},
        **{
            statements_of.__name__: statements_table(statements_of(numbers))
            for statements_of in statement_functions
        },
        minutes=numbers["seconds"] / 60,
        runs=adaptive["runs"],
        fine=f"{min(fine):.0f} to {max(fine):.0f} %",
        claimed=percent(max(cell["claimed"] for cell in numbers["sweep"])),
        reactions=errors_table(stiff),
        sweep=sweep_table(numbers),
        displacements=errors_table(soft),
    )
