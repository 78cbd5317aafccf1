"""Measure how readable the package is, from its syntax trees; fail where a measure got worse.

The table compares each measure with its ceiling, which metrics.json beside this file records, and
with its goal. ``--record`` lowers the ceilings to today's values, but not below the goals. Words,
constants and types are counted per thousand names or statements, so that new features do not count
as disorder. Shares may rise by half a percent, as they do where good code is deleted. The ceiling
of the number of statements may be raised by hand, in a commit that says why.
"""

from __future__ import annotations

import ast
import json
import math
import re
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "flexband"
CEILINGS = Path(__file__).with_suffix(".json")

VAGUE = {
    "own", "one", "found", "told", "here", "left", "wanted",
    "item", "got", "gotten", "seen", "mine", "theirs", "thing", "stuff", "ones",
}  # fmt: skip
"""Pronouns and participles that do not say what a variable holds."""

PARTICIPLES = {
    "given", "kept", "known", "chosen", "shown", "again", "both", "every", "each", "several",
    "apart", "between", "finer", "good", "among", "used", "needed", "most", "least", "more",
    "further", "away", "back", "begun", "held", "free", "slow", "near", "far", "whole", "rough",
    "started", "simulated", "placed", "turned", "raised", "joined", "narrowed", "located",
    "noticed", "suspected", "stated", "named", "returned", "described", "mapped", "evaluated",
    "checked",
}  # fmt: skip
"""Participles and quantifiers that do not say what a variable holds."""

NOUNS = {
    "string", "spring", "ring", "bearing", "bushing", "damping", "heading", "mapping", "bed",
    "seed", "speed", "feed", "sorted",
}  # fmt: skip
"""Words that end as participles do."""

FILE_NAMES = {
    "study.json", "results.json", "bands.nc", "surrogate.npz", "verification.nc", "limits.nc",
    "contributions.nc", "probability.nc", "path.nc", "page.json", "report.html", "holder",
}  # fmt: skip
"""Files in the folder of a study."""


@dataclass(frozen=True)
class Module:
    """A file of the package.

    Attributes
    ----------
    name
        Dotted, without the package: "study.run".
    text
        What the file holds.
    """

    name: str
    text: str

    @cached_property
    def tree(self) -> ast.Module:
        return ast.parse(self.text)

    @cached_property
    def nodes(self) -> list[ast.AST]:
        return list(ast.walk(self.tree))

    @cached_property
    def imports(self) -> set[str]:
        """Dotted names of what is imported from the package, but not for types alone.

        Commands import what stands below ``if TYPE_CHECKING`` when they are called.
        """
        names = set()
        types = {
            id(node)
            for block in self.tree.body
            if isinstance(block, ast.If) and ast.unparse(block.test) == "TYPE_CHECKING"
            if not re.search(r"\n@(app\.command|answer_command)\(", self.text)
            for node in ast.walk(block)
        }
        for node in (node for node in self.nodes if id(node) not in types):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("flexband"):
                names |= {f"{node.module}.{alias.name}" for alias in node.names}
            elif isinstance(node, ast.Import):
                names |= {alias.name for alias in node.names if alias.name.startswith("flexband")}
        return {name.removeprefix("flexband").lstrip(".") for name in names}


class Package:
    """The modules of the package, and which of them import which."""

    def __init__(self, source: Path = SOURCE) -> None:
        self.modules = {
            ".".join(file.relative_to(source).with_suffix("").parts): Module(
                ".".join(file.relative_to(source).with_suffix("").parts),
                file.read_text(encoding="utf-8"),
            )
            for file in sorted(source.rglob("*.py"))
        }

    @cached_property
    def statements(self) -> int:
        """The number of statements but docstrings, whose length does not matter."""
        statements = [node for node in self.nodes if isinstance(node, ast.stmt)]
        texts = [
            s for s in statements if isinstance(s, ast.Expr) and isinstance(s.value, ast.Constant)
        ]
        return len(statements) - len(texts)

    @cached_property
    def nodes(self) -> list[ast.AST]:
        return [node for module in self.modules.values() for node in module.nodes]

    def imported(self, module: str) -> set[str]:
        """Return the modules that one imports directly."""
        names = self.modules[module].imports
        candidates = names | {name.rpartition(".")[0] for name in names}
        return (candidates & self.modules.keys()) - {module}

    def reachable(self, module: str) -> set[str]:
        """Return the modules that one imports, directly or through others."""
        known: set[str] = set()
        waiting = [module]
        while waiting:
            new = self.imported(waiting.pop()) - known
            known |= new
            waiting += new
        return known


def vague_names(package: Package) -> float:
    """Return how many of a thousand variables and parameters are pronouns instead of nouns."""
    return share_of_names(package, VAGUE)


def participles(package: Package) -> float:
    """Return how many of a thousand variables and parameters are participles or quantifiers."""
    return share_of_names(package, PARTICIPLES)


def participles_and_attributes(package: Package) -> float:
    """Return how many of a thousand names, those of attributes included, are participles."""
    names = []
    for node in package.nodes:
        match node:
            case ast.Name(id=name) | ast.arg(arg=name) | ast.Attribute(attr=name):
                names.append(name)
            case ast.keyword(arg=str(name)):
                names.append(name)
    return 1000 * sum(name.strip("_") in PARTICIPLES for name in names) / len(names)


def share_of_names(package: Package, words: set[str]) -> float:
    """Return how many of a thousand variables and parameters are among some words."""
    names = [
        node.id if isinstance(node, ast.Name) else node.arg
        for node in package.nodes
        if isinstance(node, ast.Name | ast.arg)
    ]
    return 1000 * sum(name.strip("_") in words for name in names) / len(names)


def participle_functions(package: Package) -> float:
    """Return how many of a hundred functions are named by one participle."""
    functions = [node.name for node in package.nodes if isinstance(node, ast.FunctionDef)]
    single = [name for name in functions if re.fullmatch(r"_?[a-z]+(ed|en|ing)", name)]
    return 100 * sum(name.strip("_") not in NOUNS for name in single) / len(functions)


def paired_assignments(package: Package) -> float:
    """Return how many of a thousand statements assign several values at once, a, b = x, y."""
    pairs = [
        node
        for node in package.nodes
        if isinstance(node, ast.Assign)
        and isinstance(node.targets[0], ast.Tuple)
        and isinstance(node.value, ast.Tuple)
    ]
    return 1000 * len(pairs) / package.statements


def largest_module(package: Package) -> int:
    """Return the number of statements of the largest module."""
    modules = package.modules.values()
    return max(sum(isinstance(node, ast.stmt) for node in module.nodes) for module in modules)


def lines_per_comment(package: Package) -> float:
    """Return the number of lines per line that is a comment."""
    lines = [line.strip() for m in package.modules.values() for line in m.text.splitlines()]
    return len(lines) / max(1, sum(line.startswith("#") for line in lines))


def factories_of(package: Package) -> float:
    """Return how many functions are called `of`."""
    return sum(isinstance(node, ast.FunctionDef) and node.name == "of" for node in package.nodes)


def empty_packages(package: Package) -> float:
    """Return how many packages do not say what they hold."""
    modules = package.modules.items()
    return sum(not m.text.strip() for name, m in modules if name.endswith("__init__"))


def most_imports(package: Package) -> int:
    """Return the largest number of the package's modules that a single module imports."""
    return max(
        len(package.imported(name)) for name in package.modules if not name.endswith("__init__")
    )


def imports_of_the_study(package: Package) -> float:
    """Return how many modules study/run.py imports; infinite where it reaches what draws."""
    if "study.run" not in package.modules:
        return float("inf")
    drawing = {
        name
        for name in package.reachable("study.run")
        if name.split(".")[0] in ("cli", "report", "plot")
    }
    return float("inf") if drawing else len(package.imported("study.run"))


def _targets(statement: ast.stmt) -> Iterator[ast.Name]:
    match statement:
        case ast.Assign(targets=targets):
            for target in targets:
                yield from (n for n in ast.walk(target) if isinstance(n, ast.Name))
        case ast.AnnAssign(target=ast.Name() as target):
            yield target


def _documented(module: Module, body: list[ast.stmt], index: int) -> bool:
    """Return whether a text follows a declaration, or a comment is beside it or above."""
    following = body[index + 1] if index + 1 < len(body) else None
    if isinstance(following, ast.Expr) and isinstance(following.value, ast.Constant):
        return True
    lines, line = module.text.splitlines(), body[index].lineno - 1
    return "  # " in lines[line] or lines[line - 1].lstrip().startswith("# ")


def _is_number(node: ast.expr | None) -> bool:
    if isinstance(node, ast.UnaryOp):
        node = node.operand
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)


def tuning_constants(package: Package) -> float:
    """Return the constants of modules and undocumented numbers of classes, per 1000 statements."""
    count = 0
    for module in package.modules.values():
        for statement in module.tree.body:
            count += sum(target.id.lstrip("_").isupper() for target in _targets(statement))
        for node in module.nodes:
            if isinstance(node, ast.ClassDef):
                text = ast.get_docstring(node) or ""
                for index, statement in enumerate(node.body):
                    if isinstance(statement, ast.Assign | ast.AnnAssign) and _is_number(
                        statement.value
                    ):
                        names = [target.id for target in _targets(statement)]
                        described = _documented(module, node.body, index) or all(
                            re.search(rf"\b{name}\b", text) for name in names
                        )
                        count += 0 if described else len(names)
    return 1000 * count / package.statements


def probes(package: Package) -> int:
    """Return how often an object is asked whether it has an attribute."""
    count = 0
    for node in package.nodes:
        match node:
            case ast.Call(func=ast.Name("getattr"), args=[_, _, _]):
                count += 1
            case ast.Call(func=ast.Name("hasattr")):
                count += 1
            case ast.ExceptHandler(type=ast.expr() as kind):
                names = {n.id for n in ast.walk(kind) if isinstance(n, ast.Name)}
                count += "AttributeError" in names
    return count


def type_tests(package: Package) -> float:
    """Return how often code asks for the class of an object, per 1000 statements."""
    count = 0
    for node in package.nodes:
        match node:
            case ast.Call(func=ast.Name("isinstance")) | ast.MatchClass():
                count += 1
            case ast.Compare(left=ast.Call(func=ast.Name("type")), ops=[ast.Is() | ast.IsNot()]):
                count += 1
    return 1000 * count / package.statements


def _annotations(node: ast.AST) -> Iterator[ast.expr]:
    match node:
        case ast.arg(annotation=ast.expr() as annotation) | ast.AnnAssign(annotation=annotation):
            yield annotation
        case ast.FunctionDef(returns=ast.expr() as annotation):
            yield annotation


def open_types(package: Package) -> float:
    """Return annotations that say nothing, casts and ignored checks, per 1000 statements."""
    count = 0
    for node in package.nodes:
        if isinstance(node, ast.Name) and node.id == "Any":
            count += 1
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            count += node.func.id == "cast"
        for annotation in _annotations(node):
            count += sum(isinstance(n, ast.Name) and n.id == "object" for n in ast.walk(annotation))
    ignored = r"#\s*(type|pyright):\s*ignore"
    count += sum(len(re.findall(ignored, module.text)) for module in package.modules.values())
    return 1000 * count / package.statements


def modules_with_file_names(package: Package) -> int:
    """Return how many modules spell the name of a file of a study."""
    return sum(
        any(isinstance(node, ast.Constant) and node.value in FILE_NAMES for node in module.nodes)
        for module in package.modules.values()
    )


def repeated_classes(package: Package) -> int:
    """Return how many names belong to several classes of the package."""
    names = Counter(
        node.name
        for module in package.modules.values()
        for node in module.tree.body
        if isinstance(node, ast.ClassDef)
    )
    return sum(count > 1 for count in names.values())


@dataclass(frozen=True)
class Measure:
    """A measure of the package, of which less is better.

    Attributes
    ----------
    name
        As metrics.json and the table have it.
    of
        Computes it.
    goal
        Largest value that is good enough.
    """

    name: str
    of: Callable[[Package], float]
    goal: float
    folder: str = "src/flexband"


SLACK = 0.005
"""By how much a measure may be above its ceiling."""

MEASURES = [
    Measure("vague names, per 1000 names", vague_names, 3.0),
    Measure("modules that one module imports, most", most_imports, 15),
    Measure("modules that study/run.py imports", imports_of_the_study, 15),
    Measure("module constants, per 1000 statements", tuning_constants, 10.4),
    Measure("getattr with default, hasattr, AttributeError", probes, 10),
    Measure("isinstance, type() is, class patterns, per 1000 statements", type_tests, 10.4),
    Measure("Any, object, cast, ignored checks, per 1000 statements", open_types, 14.6),
    Measure("modules with names of a study's files", modules_with_file_names, 1),
    Measure("names of several classes", repeated_classes, 0),
    Measure("statements", lambda package: package.statements, 46000),
    Measure("statements of the largest module", largest_module, 300),
    Measure("lines per comment line", lines_per_comment, 120),
    Measure("participles, attributes included, per 1000 names", participles_and_attributes, 4.0),
    Measure("factories called of", factories_of, 0),
    Measure("empty __init__.py", empty_packages, 0),
    Measure("vague names in tests, per 1000 names", vague_names, 3.0, "tests"),
    Measure("vague names in benchmarks, per 1000 names", vague_names, 3.0, "benchmarks"),
]
for _folder, _place in (
    ("src/flexband", ""),
    ("tests", " in tests"),
    ("benchmarks", " in benchmarks"),
):
    MEASURES += [
        Measure(f"participles{_place}, per 1000 names", participles, 4.0, _folder),
        Measure(f"functions named by a participle{_place}, %", participle_functions, 3.0, _folder),
        Measure(f"a, b = x, y{_place}, per 1000 statements", paired_assignments, 8.0, _folder),
    ]


def main(*, record: bool) -> int:
    """Print the measures; return 1 if one is above its ceiling, 0 otherwise."""
    ceilings = json.loads(CEILINGS.read_text(encoding="utf-8"))
    packages = {folder: Package(ROOT / folder) for folder in {m.folder for m in MEASURES}}
    table = Table("measure", "today", "ceiling", "goal")
    exceeded = []
    for measure in MEASURES:
        value = round(measure.of(packages[measure.folder]), 2)
        ceiling = ceilings.get(measure.name, math.inf)
        table.add_row(measure.name, *(f"{x:g}" for x in (value, ceiling, measure.goal)))
        if value > ceiling * (1 + SLACK):
            exceeded.append(f"{measure.name}: {value:g}, at most {ceiling:g} before")
        ceilings[measure.name] = max(min(value, ceiling), measure.goal)
    Console().print(table)
    if record:
        CEILINGS.write_text(json.dumps(ceilings, indent=1) + "\n", encoding="utf-8")
    print("\n".join(exceeded), end="\n" * bool(exceeded), file=sys.stderr)
    return int(bool(exceeded))


if __name__ == "__main__":
    sys.exit(main(record="--record" in sys.argv[1:]))
