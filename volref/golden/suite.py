"""Suites: recipes that belong together, each with the digests and the picture that a repository keeps.

A suite is a JSON file:

    {"format": "volref-suite", "format_version": 1, "name": "mine", "recipes": [{...}, "other.json"]}

with recipes, or paths of their files.  Beside `mine.json` lie `mine.hashes.json`, the digests of what they
make, and `mine.previews/NAME.png`, the canvases.  "volref" names the suite of this package.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from volref.errors import FormatError
from volref.golden.digests import digest_of_document
from volref.golden.environment import environment
from volref.golden.recipe import Recipe, load_recipe, recipe_of
from volref.io.atomic import write_text
from volref.io.documents import check_format, find_problem
from volref.io.guard import Foreign, path_inside, read_json

FORMAT, HASHES_FORMAT, FORMAT_VERSION = "volref-suite", "volref-suite-hashes", 1

BUILT_IN = "volref"

# Digests of what a recipe makes.
PARTS = ("scene", "inputs", "nominal", "passes", "interval")

_TEXT = {"type": "string", "minLength": 1}
SCHEMA: dict[str, Any] = {
    "type": "object",
    "additionalProperties": False,
    "required": ["format", "format_version", "name", "recipes"],
    "properties": {
        "format": {},
        "format_version": {},
        "name": _TEXT,
        "title": {"type": "string"},
        "recipes": {"type": "array", "minItems": 1, "items": {"anyOf": [_TEXT, {"type": "object"}]}},
    },
}
_DIGEST = {"anyOf": [{"type": "string"}, {"const": None}]}
HASHES_SCHEMA: dict[str, Any] = {
    "type": "object",
    "additionalProperties": False,
    "required": ["format", "format_version", "environment", "goldens"],
    "properties": {
        "format": {},
        "format_version": {},
        "environment": {"type": "object"},
        "goldens": {"type": "object"},
    },
}
GOLDEN_SCHEMA: dict[str, Any] = {
    "type": "object",
    "additionalProperties": False,
    "required": list(PARTS),
    "properties": dict.fromkeys(PARTS, _DIGEST),
}


@dataclass(frozen=True)
class Suite:
    """Recipes by name, and the file they come from."""

    name: str
    recipes: Mapping[str, Recipe]
    file: Path

    @property
    def hashes_file(self) -> Path:
        """Where the digests lie."""
        return self.file.with_name(f"{self.file.stem}.hashes.json")

    def preview(self, name: str) -> Path:
        """Where the canvas of a golden lies."""
        return self.file.with_name(f"{self.file.stem}.previews") / f"{name}.png"


@dataclass(frozen=True)
class Hashes:
    """Digests of what a suite makes, and what they were computed with.

    goldens: by name, digests of the parts; None where nobody has computed one.
    """

    environment: Mapping[str, Any]
    goldens: Mapping[str, Mapping[str, str | None]]

    @property
    def digest(self) -> str:
        """One digest of all images: what the changelog names."""
        images = {
            name: {part: digests[part] for part in ("nominal", "passes")}
            for name, digests in self.goldens.items()
        }
        return digest_of_document(images)


def load_suite(source: str | Path) -> Suite:
    """Return a suite from its file, or the built-in one by its name, "volref".

    Raises
    ------
    FormatError
        If there is none, a recipe breaks its schema, or two have one name.

    Examples
    --------
    >>> suite = load_suite("volref")
    >>> len(suite.recipes) >= 24
    True
    """
    file = built_in_file() if source == BUILT_IN else Path(source)
    document: Any = read_json(file)
    check_format(file, document, FORMAT)
    _check(file, document, SCHEMA)
    recipes: dict[str, Recipe] = {}
    for entry in document["recipes"]:
        recipe = load_recipe(path_inside(file, entry)) if isinstance(entry, str) else recipe_of(entry, file)
        if recipe.name in recipes:
            message = f"{file.name}: recipes must have names of their own, got {recipe.name!r} twice; "
            raise FormatError(message + "rename one")
        recipes[recipe.name] = recipe
    return Suite(document["name"], recipes, file)


def is_suite(file: Path) -> bool:
    """Whether a JSON file says that it is a suite."""
    document = read_json(file)
    return isinstance(document, dict) and document.get("format") == FORMAT


@cache
def built_in_file() -> Path:
    """Return the file of the suite that comes with this package."""
    return Path(str(resources.files("volref.golden").joinpath("suite", "volref.json")))


def load_hashes(suite: Suite) -> Hashes:
    """Return the digests that lie beside a suite.

    Raises
    ------
    FormatError
        If there are none, or they break the format.
    """
    file = suite.hashes_file
    document: Any = read_json(file)
    check_format(file, document, HASHES_FORMAT)
    _check(file, document, HASHES_SCHEMA)
    for name, digests in document["goldens"].items():
        _check(file, digests, GOLDEN_SCHEMA, f"goldens.{name}")
    return Hashes(document["environment"], document["goldens"])


def save_hashes(suite: Suite, goldens: Mapping[str, Mapping[str, str | None]]) -> Hashes:
    """Write the digests of a suite beside it, in place of those that are there."""
    hashes = Hashes(environment(), {name: dict(goldens[name]) for name in sorted(goldens)})
    document = {"format": HASHES_FORMAT, "format_version": FORMAT_VERSION}
    document |= {"environment": hashes.environment, "goldens": hashes.goldens}
    write_text(suite.hashes_file, json.dumps(document, indent=1) + "\n", overwrite=True)
    return hashes


def _check(file: Path, document: Foreign, schema: Mapping[str, Any], name: str = "") -> None:
    problem = find_problem(document, schema, {}, name)
    if problem is not None:
        raise FormatError(f"{file.name}: {problem}")
