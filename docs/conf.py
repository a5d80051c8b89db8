"""How Sphinx builds these pages: `sphinx-build -W -n -b html docs OUT`, without a network."""

import inspect
import re
from importlib import metadata

from sphinx.application import Sphinx
from sphinx.util.docstrings import prepare_docstring

project = "volref"
author = "the volref authors"
project_copyright = author
release = version = metadata.version("volref")

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["_build"]
smartquotes_action = "D"  # dashes only: "cell" is a word to type, not one to set

myst_heading_anchors = 3

# The fields of a frozen record stand in the docstring of its class and are no members of their own, so
# `undoc-members` stays off; what has a docstring itself (methods, properties) is listed.
autodoc_default_options = {"members": True, "member-order": "bysource"}
autodoc_preserve_defaults = True
# Written out, the annotation of an array is longer than what it says: shapes and units are in the docstrings.
autodoc_typehints = "none"
napoleon_google_docstring = False
napoleon_attr_annotations = False

html_theme = "furo"
html_title = f"volref {release}"
html_copy_source = False


def setup(app: Sphinx) -> None:
    """Mend pages and docstrings on the way in; napoleon's priority is 500, and `_mend` comes after it."""
    app.connect("source-read", _trim)
    app.connect("autodoc-process-docstring", _mend, priority=600)


def _trim(_app: Sphinx, _name: str, content: list[str]) -> None:
    """Drop the empty line that doctest needs between an expected output and the end of its block."""
    content[0] = content[0].replace("\n\n```\n", "\n```\n")


def _mend(_app: Sphinx, what: str, _name: str, thing: object, _options: object, lines: list[str]) -> None:
    """Undo what napoleon makes of "kind: ..." in a property, and make `code` code.

    In reStructuredText one backtick is a reference, and a word directly after it an error.
    """
    if what in ("property", "attribute"):
        lines[:] = prepare_docstring(inspect.getdoc(thing) or "")
    lines[:] = [re.sub(r"(?<![`:])`([^`]+)`(?!`)", r"``\1``\\ ", line) for line in lines]
