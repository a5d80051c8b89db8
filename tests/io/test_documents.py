"""The reader of scene.json and the published schema say the same of every document."""

import copy

import jsonschema
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.bad_files import CAMERA, SCENES, TRANSFER, TRIANGLE, scene_document
from volref.errors import FormatError
from volref.io import scene_schema
from volref.io.documents import KEYWORDS, TYPES, check_document, find_problem, whole_numbers
from volref.io.guard import read_json
from volref.io.raw import RAW_TYPES
from volref.io.readers import READERS
from volref.scene.volume import IDENTITY

SCHEMA = scene_schema()
JUDGE = jsonschema.Draft202012Validator(SCHEMA)
VIEW = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -5], [0, 0, 0, 1]]
PLANES = {"near": 0.5, "far": 9}
LOOK = {"eye": [0, 0, 5], "target": [0, 0, 0], "up": [0, 1, 0]}
EXTINCTION = {"values": [0], "colors": [[1, 1, 1]], "extinction": [2], "interpolation": "extinction"}
ATLAS = {"tiles_across": 2, "tiles_down": 2, "slices": 4, "first_tile": "top", "rows": "up", "padding": 0}
RAW = {"size": [1, 2, 3], "dtype": "int16", "byte_order": "big", "skip": 0}
PLACE = {"spacing": [1, 1, 1], "origin": [0, 0, 0], "direction": IDENTITY, "centering": "node"}

VALID = [
    scene_document(),
    scene_document(
        background=[0, 0, 0, 1], meshes=[{"path": "a.ply"}, TRIANGLE | {"colors": [[1, 0, 0]] * 3}]
    ),
    scene_document(meshes=[TRIANGLE | {"colors": [1, 0, 0], "coloring": "uniform"}]),
    scene_document(camera={"kind": "perspective", "view_from_world": VIEW, "fov_y": 40, **PLANES}),
    scene_document(camera={"kind": "orthographic", **LOOK, "height": 2, **PLANES, "clip_z": "0..1"}),
    scene_document(camera={"kind": "orthographic", "view_from_world": VIEW, "height": 2, **PLANES}),
    scene_document(camera={"kind": "matrix", "view_from_world": VIEW, "clip_from_view": VIEW}),
    scene_document(volume={"path": "v.npy", **PLACE, "nan": 0}, transfer=TRANSFER),
    scene_document(volume={"path": "v.raw", **RAW, "nan": "refuse"}, transfer=EXTINCTION),
    scene_document(volume={"path": "v.png", **ATLAS, "channel": "alpha"}, transfer={"path": "t.json"}),
    scene_document(
        volume={"path": "v.npz", "key": "head"},
        transfer={"path": "t.png", "domain": [0, 1], "unit_distance": 1, "texel_centers": False},
    ),
    scene_document(transfer=TRANSFER | {"units": "HU", "domain": [0, 1], "interpolation": "extinction"}),
]
VALUES = [None, True, False, 0, 1, 1.0, 1.5, -3, "", "text", "matrix", [], [1, 2, 3], {}, {"path": "a"}]
KEYS = ["path", "kind", "near", "eye", "values", "colors", "opacity", "nonsense", "width"]


def our_verdict(document):
    return find_problem(document, SCHEMA, SCHEMA["$defs"], "") is None


def places(document, path=()):
    """Return the path of every value in a document."""
    found = [path]
    items = document.items() if isinstance(document, dict) else enumerate(document)
    for key, value in items:
        found += places(value, (*path, key)) if isinstance(value, dict | list | tuple) else [(*path, key)]
    return found


def parent_of(document, path):
    for key in path[:-1]:
        document = document[key]
    return document


@st.composite
def mutated(draw):
    document = copy.deepcopy(draw(st.sampled_from(VALID)))
    document = {**document} | ({"meshes": list(document["meshes"])} if "meshes" in document else {})
    for _ in range(draw(st.integers(1, 2))):
        path = draw(st.sampled_from([place for place in places(document) if place]))
        parent = parent_of(document, path)
        if not isinstance(parent, dict | list):
            continue
        way = draw(st.sampled_from(["replace", "remove", "add"]))
        if way == "replace":
            parent[path[-1]] = copy.deepcopy(draw(st.sampled_from(VALUES)))
        elif way == "remove":
            del parent[path[-1]]
        elif isinstance(parent, dict):
            parent[draw(st.sampled_from(KEYS))] = copy.deepcopy(draw(st.sampled_from(VALUES)))
        else:
            parent.append(copy.deepcopy(draw(st.sampled_from(VALUES))))
        if not document:
            break
    return document


def as_json(document):
    """Return a document with lists for tuples, as JSON has it."""
    if isinstance(document, dict):
        return {key: as_json(value) for key, value in document.items()}
    return [as_json(value) for value in document] if isinstance(document, list | tuple) else document


def test_the_schema_is_a_valid_schema():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)


@pytest.mark.parametrize("document", VALID)
def test_both_accept_a_document_of_each_kind(document):
    document = as_json(document)
    assert JUDGE.is_valid(document)
    assert our_verdict(document)


@given(mutated().map(as_json))
def test_both_say_the_same_of_a_document_with_something_changed(document):
    assert our_verdict(document) == JUDGE.is_valid(document)


@pytest.mark.parametrize("case", SCENES, ids=lambda case: case.name)
def test_both_say_the_same_of_the_bad_scenes(tmp_path, case):
    path = case.build(tmp_path)
    try:
        document = read_json(path)
    except FormatError:
        return  # not JSON at all: neither gets to see it
    assert our_verdict(document) == JUDGE.is_valid(document)


def keywords(rule):
    """Return every schema keyword in use, without the names of properties and definitions."""
    found = set(rule)
    for key, value in rule.items():
        if key in ("properties", "$defs"):
            parts = list(value.values())
        elif key == "anyOf":
            parts = value
        else:
            parts = [value] if key == "items" else []
        for part in parts:
            found |= keywords(part)
    return found


def test_the_reader_knows_every_word_that_the_schema_uses():
    assert keywords(SCHEMA) <= KEYWORDS
    assert set(TYPES) >= {"object", "array", "string", "number", "integer", "boolean"}


def test_the_schema_lists_what_the_volume_readers_take():
    stated = set(SCHEMA["$defs"]["volume"]["properties"])
    taken = {key for reader in READERS.values() for key in (*reader.keys, *reader.needed)}
    assert stated == taken | {"path", "nan", "spacing", "origin", "direction", "centering"}
    assert SCHEMA["$defs"]["volume"]["properties"]["dtype"]["enum"] == list(RAW_TYPES)


@pytest.mark.parametrize(
    ("version", "valid"), [(1, True), (1.0, True), (True, False), ("1", False), (2, False)]
)
def test_both_take_1_and_1_0_for_the_version_but_not_true(version, valid):
    document = as_json(scene_document(format_version=version))
    assert our_verdict(document) == JUDGE.is_valid(document) == valid


def test_an_unknown_key_is_named_with_the_nearest_known_one(tmp_path):
    document = scene_document(camera={**CAMERA, "fovy": 3})
    with pytest.raises(FormatError, match=r"scene\.json: camera\.fovy must be .* use 'fov_y'$"):
        check_document(tmp_path / "scene.json", document)


def with_points(value):
    """Return a document with every int as a float."""
    if isinstance(value, dict):
        return {key: with_points(item) for key, item in value.items()}
    if isinstance(value, list):
        return [with_points(item) for item in value]
    return float(value) if type(value) is int else value


def types(value):
    """Return a document with the type of every value in its place."""
    if isinstance(value, dict):
        return {key: types(item) for key, item in value.items()}
    return [types(item) for item in value] if isinstance(value, list) else type(value)


INTEGERS = ("width", "height", "size", "skip", "tiles_across", "tiles_down", "slices", "padding", "faces")


def integers(document):
    """Return the values of the keys that hold whole numbers."""
    parts = [document, document.get("volume", {}), *document.get("meshes", [])]
    return [part[key] for part in parts for key in INTEGERS if key in part]


@pytest.mark.parametrize("document", VALID)
def test_a_whole_number_may_be_written_with_a_point(document):
    """JSON Schema takes 4.0 for an integer; the records do not, so the reader hands them 4."""
    document = as_json(document)
    pointed = with_points(document)
    assert JUDGE.is_valid(pointed)
    assert our_verdict(pointed)
    whole = whole_numbers(pointed)
    assert whole == document
    assert types(integers(whole)) == types(integers(document))
    assert types(whole["camera"]) == types(pointed["camera"])  # no number but the integers is touched


def test_what_no_integer_is_stays_as_it_is():
    document = {
        "width": 1.5,
        "height": True,
        "nonsense": 2.0,
        "meshes": [{"faces": 3.0}],
        "background": [1.0],
    }
    assert whole_numbers(document) == document
    assert types(whole_numbers(document)) == types(document)
    assert whole_numbers({"width": 1e300}) == {"width": 1e300}
    assert isinstance(whole_numbers({"width": 1e300})["width"], float)
