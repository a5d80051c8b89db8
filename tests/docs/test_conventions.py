"""docs/ names tests; each of them exists."""

import ast
import re

import pytest

from tests.docs.pages import DOCS

ROOT = DOCS.parent
PAGES = sorted(DOCS.rglob("*.md"))
NAMED = re.compile(r"`(tests/[\w/]+\.py)(?:::(\w+))?`")


def names_in(path):
    """Return the names of the test functions in a file."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


def named_tests():
    return sorted({name for page in PAGES for name in NAMED.findall(page.read_text(encoding="utf-8"))})


@pytest.mark.parametrize(("file", "test"), named_tests())
def test_each_test_that_a_page_names_exists(file, test):
    path = ROOT / file
    assert path.is_file()
    assert not test or (test.startswith("test_") and test in names_in(path))


def conventions():
    """Return {sentence: tests named under it} of the conventions page."""
    text = (DOCS / "conventions.md").read_text(encoding="utf-8")
    parts = re.split(r"^(?=\*\*)|^## .*$", text, flags=re.MULTILINE)
    return {part.split("**")[1]: NAMED.findall(part) for part in parts if part.startswith("**")}


def test_the_page_holds_the_conventions():
    assert len(conventions()) > 50


@pytest.mark.parametrize("sentence", conventions())
def test_each_convention_names_a_test(sentence):
    assert conventions()[sentence]
