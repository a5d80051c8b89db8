"""docs/scene_format.md names every key of the schema, and no other."""

import json
import re

import volref as vr
from tests.docs.pages import DOCS, captioned_files

PAGE = DOCS / "scene_format.md"


def keys_of(schema):
    """Return the names of all properties in a JSON Schema, at any depth."""
    if isinstance(schema, list):
        return set().union(*map(keys_of, schema))
    if not isinstance(schema, dict):
        return set()
    nested = [keys_of(part) for name, part in schema.items() if name != "properties"]
    properties = schema.get("properties", {})
    return set(properties).union(*nested, *map(keys_of, properties.values()))


def keys_of_the_page():
    """Return the words in backticks that stand in the tables' columns of keys, and beside them."""
    text = PAGE.read_text(encoding="utf-8")
    return set(re.findall(r"`([a-z_]+)`", text))


def test_every_key_of_the_schema_is_explained():
    assert keys_of(vr.scene_schema()) <= keys_of_the_page()


def test_every_key_of_the_tables_is_in_the_schema():
    rows = re.findall(r"^\| ((?:`[a-z_]+`(?:, )?)+) \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    keys = {key for row in rows for key in re.findall(r"`([a-z_]+)`", row)}
    assert len(keys) > 20
    assert keys <= keys_of(vr.scene_schema())


def test_the_example_shows_each_key_of_a_scene():
    example = json.loads(captioned_files(PAGE)["scene.json"])
    # A radar stands in the place of a volume, and the other two belong to other modes.
    elsewhere = {"radar", "isovalue", "slice_plane"}
    assert set(example) | elsewhere == set(vr.scene_schema()["properties"])
    assert not set(example) & elsewhere
