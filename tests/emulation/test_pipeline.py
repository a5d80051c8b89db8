"""Pipelines: JSON both ways, files from strangers, the schema."""

import json

import jsonschema
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import volref as vr
from tests.emulation import strategies
from volref.emulation.catalogue import MODULES
from volref.emulation.files.documents import LARGEST_BYTES
from volref.emulation.pipeline import GROUPS, Pipeline
from volref.emulation.switches import Word, switches_of

SCHEMA = vr.pipeline_schema()
VALIDATOR = jsonschema.Draft202012Validator(SCHEMA)


@given(strategies.pipelines())
@settings(max_examples=50)
def test_json_holds_every_pipeline_and_the_schema_accepts_it(pipeline):
    assert Pipeline.from_json(pipeline.to_json()) == pipeline
    VALIDATOR.validate(json.loads(pipeline.to_json()))


@pytest.mark.parametrize("name", vr.pipelines())
def test_the_catalogue_goes_through_files_and_the_schema(name, tmp_path):
    pipeline = vr.pipelines()[name]
    path = tmp_path / "mine.json"
    path.write_text(pipeline.to_json(), encoding="utf-8")
    assert vr.load_pipeline(path) == pipeline
    assert pipeline.name == name
    VALIDATOR.validate(json.loads(pipeline.to_json()))
    assert pipeline.title
    assert pipeline.source


def test_no_two_pipelines_of_the_catalogue_are_equal():
    everything = [pipeline for module in MODULES for pipeline in module.PIPELINES]
    switches = [tuple(getattr(pipeline, name) for name in GROUPS) for pipeline in everything]
    assert len(set(switches)) == len(everything) == len(vr.pipelines())


def test_the_schema_is_one():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)


# Name of the file's key and a value that breaks its rule, with the sentence.
BROKEN = {
    "format": ("volref-scene", r"pipeline.format must be 'volref-pipeline', got 'volref-scene'"),
    "version": (2, r"pipeline.version must be 1, got 2"),
    "name": ("", r"pipeline.name must be a short name, got ''"),
    "title": (3, r"pipeline.title must be a text, got 3"),
    "source": (None, r"pipeline.source must be a text, got None"),
    "domain": ([1], r"pipeline.domain must"),
    "rays": ([], r"pipeline.rays must be an object of switches, got \[\]"),
    "stepping": (
        {"stpes": 3},
        r"pipeline.stepping must have switches it knows, got 'stpes'; use one of rule",
    ),
    "table": ({"size": 1}, r"pipeline.table.size must be a whole number from 2 to 65536, got 1"),
    "opacity": ({"factor": -1}, r"pipeline.opacity.factor must be at least 0, got -1"),
    "accumulation": ({"normalize": True}, r"pipeline.accumulation.normalize must be 'none'"),
    "meshes": ({"kind": "depths"}, r"pipeline.meshes.kind must be"),
    "lightning": ({}, r"pipeline must have switches it knows, got 'lightning'"),
}


@pytest.mark.parametrize("key", BROKEN)
def test_a_document_that_breaks_a_rule_is_refused_by_a_sentence_and_by_the_schema(key):
    value, sentence = BROKEN[key]
    document = vr.pipelines()["texture3d"].as_dict() | {key: value}
    with pytest.raises(vr.SceneError, match=f"^{sentence}"):
        Pipeline.from_dict(document)
    assert not VALIDATOR.is_valid(document)


@pytest.mark.parametrize("key", ["format", "version", "name"])
def test_what_a_document_must_have_is_missed(key):
    document = vr.pipelines()["texture3d"].as_dict()
    del document[key]
    with pytest.raises(vr.SceneError, match=rf"^pipeline.{key} must be"):
        Pipeline.from_dict(document)
    assert not VALIDATOR.is_valid(document)


# To a schema 2.0 is a whole number, to a pipeline it is not.
FLOATS = st.floats(-2, 2).filter(lambda value: not value.is_integer())
JUNK = st.none() | st.booleans() | st.integers(-3, 3) | FLOATS | st.text(max_size=3) | st.just([])
SWITCHES = [(group, switch) for group, kind in GROUPS.items() for switch in switches_of(kind)]


@given(st.sampled_from(SWITCHES), JUNK)
@settings(max_examples=300)
def test_the_schema_accepts_a_switch_just_where_the_program_does(switch, value):
    group, rule = switch
    document = {"format": "volref-pipeline", "version": 1, "name": "x", group: {rule.name: value}}
    try:
        Pipeline.from_dict(document)
    except vr.SceneError as error:
        # Three numbers of the tone map have to rise: no schema can say so.
        accepted = "must rise" in str(error)
    else:
        accepted = True
    assert VALIDATOR.is_valid(document) == accepted


def test_the_three_numbers_of_the_tone_map_and_the_ends_of_the_domain_rise():
    with pytest.raises(vr.SceneError, match=r"output.low, mid and high must rise, got 0, 2, 1; sort them"):
        Pipeline("x").with_switches(output={"mid": 2.0})
    with pytest.raises(vr.SceneError, match=r"pipeline.domain"):
        Pipeline("x", domain=(2.0, 1.0))


def test_switches_are_changed_by_group_and_name():
    changed = Pipeline("x").with_switches("y", stepping={"steps": 7}, table={"size": 9})
    assert (changed.name, changed.stepping.steps, changed.table.size) == ("y", 7, 9)
    assert changed.with_switches("x", stepping={"steps": 100}, table={"size": 256}) == Pipeline("x")
    with pytest.raises(vr.SceneError, match=r"pipeline must have switches it knows, got 'step'"):
        Pipeline("x").with_switches(step={})
    with pytest.raises(vr.SceneError, match=r"pipeline.table must have switches it knows, got 'sise'"):
        Pipeline("x").with_switches(table={"sise": 2})
    with pytest.raises(vr.SceneError, match=r"pipeline.table must be a TableTexture, got 3"):
        Pipeline("x", table=3)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"\xff\xfe{", r"mine.json must be a readable JSON document, got 'utf-8' codec"),
        (b"{", r"mine.json must be a readable JSON document, got "),
        (b"[" * 100_000, r"mine.json must be a readable JSON document, got "),
        (b'{"a": NaN}', r"mine.json must be a readable JSON document, got the number NaN"),
        (b'{"a": 1, "a": 2}', r"mine.json must be a readable JSON document, got the key 'a' twice"),
        (b"", r"mine.json must hold data, got an empty file"),
        (b"[]", r"mine.json: pipeline must be an object of switches, got \[\]; give"),
        (b'{"format": "x"}', r"mine.json: pipeline.format must be 'volref-pipeline', got 'x'; this is"),
        (b" " * (LARGEST_BYTES + 1), r"mine.json must have at most 1 MiB, as a pipeline has, got "),
    ],
)
def test_a_file_that_is_no_pipeline_is_refused_in_one_sentence(content, sentence, tmp_path):
    path = tmp_path / "mine.json"
    path.write_bytes(content)
    with pytest.raises(vr.FormatError, match=f"^{sentence}") as raised:
        vr.load_pipeline(path)
    assert str(raised.value).count("; ") == 1
    assert "\n" not in str(raised.value)


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(vr.FormatError, match=r"must be a file that exists, got no such file"):
        vr.load_pipeline(tmp_path / "mine.json")
    with pytest.raises(vr.FormatError, match=r"must be a file that exists, got a folder"):
        vr.load_pipeline(tmp_path)


def test_text_that_is_no_json_is_refused():
    for text in ("{", "[" * 100_000):
        with pytest.raises(vr.SceneError, match=r"^pipeline must be JSON, got text that is not \("):
            Pipeline.from_json(text)


def test_every_switch_says_what_it_means_and_what_its_words_mean():
    for group, switch in SWITCHES:
        assert switch.rule.meaning, (group, switch)
        if isinstance(switch.rule, Word):
            assert len(switch.rule.choices) > 1
            assert all(switch.rule.choices.values()), (group, switch)
