"""How Sphinx makes a site of the pages in this folder (`make docs`)."""

import sys
from pathlib import Path

import flexband as fb

sys.path.insert(0, str(Path(__file__).parent))

project, author = "flexband", "the flexband authors"
release = version = fb.__version__
extensions = [
    "myst_nb",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.linkcode",
    "sphinx.ext.mathjax",
    "sphinx-mathjax-offline",  # equations are drawn without a network
    "sphinx_copybutton",
    "executed_blocks",
    "search_words",
    "source_pages",
]
exclude_patterns = ["_build", "evidence/paper.json"]
nitpicky = True
default_role = "public"  # of docstrings: see source_pages

html_theme = "furo"
html_title = "flexband"
html_static_path = ["static"]
html_css_files = ["flexband.css"]
html_copy_source = False
html_show_sphinx = html_show_copyright = False

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 600  # no page takes a tenth of it on a quiet machine
nb_merge_streams = True

copybutton_selector = "div.highlight pre:not(.cell_output *, .highlight-text *)"
copybutton_prompt_text = r">>> |\.\.\. |\$ "  # lines without one are output, and are not copied
copybutton_prompt_is_regexp = True

autosummary_generate = False
autodoc_typehints = "none"  # docstrings say what is allowed
numpydoc_show_class_members = False


def linkcode_resolve(_domain: str, info: dict[str, str]) -> str | None:
    """Return where the source of a public object is on the site, seen from the API's pages."""
    from source_pages import page_of  # noqa: PLC0415

    found = page_of(info["module"], info["fullname"])
    return found and f"../../{found}"
