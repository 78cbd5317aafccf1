"""What executed pages begin with, out of sight: vector figures, and a folder for what they write."""

import os
import tempfile

from IPython.core.getipython import get_ipython

shell = get_ipython()
assert shell is not None
shell.run_line_magic("config", "InlineBackend.figure_formats = ['svg']")
shell.run_line_magic("load_ext", "flexband")
for name in ("FORCE_COLOR", "CLICOLOR_FORCE"):
    os.environ.pop(name, None)
os.environ["COLUMNS"] = "96"
os.chdir(tempfile.mkdtemp())
