"""What executed pages begin with, out of sight: how they show figures, and where they write."""

import os
import subprocess
import tempfile
from pathlib import Path

from IPython.core.getipython import get_ipython
from matplotlib import pyplot


def sh(line: str, cell: str) -> None:
    """Run a cell of commands, and print all of their output at once, without their progress."""
    done = subprocess.run(["sh", "-ec", cell], capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{cell}\n{done.stderr}")
    print(done.stdout)


shell = get_ipython()
assert shell is not None
shell.register_magic_function(sh, "cell")
shell.run_line_magic("config", "InlineBackend.figure_formats = ['svg']")
pyplot.rcParams["figure.figsize"] = (6.0, 3.2)
for name in ("FORCE_COLOR", "CLICOLOR_FORCE"):
    os.environ.pop(name, None)
examples = Path(__file__).resolve().parents[1] / "examples"
os.environ["COLUMNS"] = "96"
os.chdir(tempfile.mkdtemp())
Path("examples").symlink_to(examples)
