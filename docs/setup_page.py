"""What executed pages begin with, out of sight: how they show figures and commands, and a folder."""

import os
import subprocess
import tempfile

from IPython.core.getipython import get_ipython
from matplotlib import pyplot


def sh(line: str, cell: str) -> None:
    """Run a cell of commands, and print all of their output at once."""
    print(subprocess.run(["sh", "-ec", cell], stdout=subprocess.PIPE, text=True, check=True).stdout)


shell = get_ipython()
assert shell is not None
shell.register_magic_function(sh, "cell")
shell.run_line_magic("config", "InlineBackend.figure_formats = ['svg']")
pyplot.rcParams["figure.figsize"] = (6.0, 3.2)
for name in ("FORCE_COLOR", "CLICOLOR_FORCE"):
    os.environ.pop(name, None)
os.environ["COLUMNS"] = "96"
os.chdir(tempfile.mkdtemp())
