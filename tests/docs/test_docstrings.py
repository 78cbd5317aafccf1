"""The examples in docstrings give what they show."""

import doctest
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import flexband as fb

PACKAGE = Path(fb.__file__).parent
MODULES = sorted(
    ".".join(file.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__")
    for file in PACKAGE.rglob("*.py")
    if ">>> " in file.read_text(encoding="utf-8")
)


@pytest.mark.parametrize("name", MODULES)
def test_examples_give_what_they_show(name):
    """As a user sees them after `import flexband as fb` and `import numpy as np`."""
    runner = doctest.DocTestRunner()
    for example in doctest.DocTestFinder().find(import_module(name), globs={"fb": fb, "np": np}):
        runner.run(example)
    assert not runner.failures
