"""docs/architecture.md shows the folders and layers as they are."""

import re
import tomllib
from pathlib import Path

import volref
from tests.docs.pages import DOCS, blocks

PAGE = DOCS / "architecture.md"
PACKAGE = Path(volref.__file__).parent


def tree_of_the_page():
    """Return the names in the tree, folders with a slash."""
    head, *lines = blocks(PAGE, "text")[0].splitlines()
    assert head == "volref/"
    return [line.split()[0] for line in lines]


def layers_of_the_page():
    return [set(line.split(" | ")) for line in blocks(PAGE, "text")[1].splitlines()]


def layers_of_the_contract():
    settings = tomllib.loads((DOCS.parent / "pyproject.toml").read_text(encoding="utf-8"))
    contract = next(c for c in settings["tool"]["importlinter"]["contracts"] if c["type"] == "layers")
    return [{name.strip().removeprefix("volref.") for name in row.split("|")} for row in contract["layers"]]


def test_the_tree_names_what_is_there_and_nothing_else():
    folders = {f"{path.name}/" for path in PACKAGE.iterdir() if path.is_dir() and path.name[0] not in "_."}
    modules = {path.name for path in PACKAGE.glob("*.py") if not path.name.startswith("__")}
    assert set(tree_of_the_page()) == folders | modules


def test_the_layers_are_those_that_the_import_linter_holds():
    assert layers_of_the_page() == layers_of_the_contract()


def test_a_package_in_the_tree_stands_where_its_layer_is():
    place = {name: i for i, row in enumerate(layers_of_the_page()) for name in row}
    order = [
        place[name]
        for entry in tree_of_the_page()
        if (name := entry.rstrip("/").removesuffix(".py")) in place
    ]
    assert order == sorted(order)


def test_every_file_that_the_page_points_to_exists():
    named = re.findall(r"`(volref/[\w/]+(?:\.py|/))`", PAGE.read_text(encoding="utf-8"))
    assert len(named) >= 8
    assert all((PACKAGE.parent / name).exists() for name in named)
