"""Sets of pipelines: what is not known of a program."""

import json

import jsonschema
import pytest

import volref as vr
from volref.emulation.pipeline import Pipeline

UNKNOWN = {
    "volume.slices": ["count", "last", "centers"],
    "stepping.steps": [100, 200],
    "stepping.cap": [None, 9],
}


def written(tmp_path, **more):
    path = tmp_path / "mine.json"
    document = vr.pipelines()["congote2012"].as_dict() | {"unknown": UNKNOWN} | more
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


def test_a_set_yields_every_combination_once(tmp_path):
    found = vr.load_candidates(written(tmp_path))
    everything = list(found)
    assert found.count == len(everything) == 12
    assert len({(p.volume, p.stepping) for p in everything}) == 12
    first = vr.pipelines()["congote2012"]
    assert everything[0] == first.with_switches(stepping={"steps": 100}, volume={"slices": "count"})
    assert [p.stepping.cap for p in everything[:3]] == [None, 9, None]
    assert found.pipeline == first


def test_a_set_goes_through_json_and_the_schema(tmp_path):
    found = vr.load_candidates(written(tmp_path))
    assert vr.Candidates.from_dict(json.loads(json.dumps(found.as_dict()))) == found
    validator = jsonschema.Draft202012Validator(vr.pipeline_schema())
    validator.validate(json.loads(json.dumps(found.as_dict())))
    assert not validator.is_valid(found.as_dict() | {"unknown": {"volume.slice": ["count"]}})
    assert not validator.is_valid(found.as_dict() | {"unknown": {"volume.slices": []}})


def test_a_pipeline_is_a_set_of_one(tmp_path):
    path = tmp_path / "one.json"
    path.write_text(Pipeline("one").to_json(), encoding="utf-8")
    found = vr.load_candidates(path)
    assert (found.count, list(found)) == (1, [Pipeline("one")])
    assert found.as_dict() == Pipeline("one").as_dict()


def test_one_pipeline_with_open_switches_is_refused_with_their_names_and_the_cure(tmp_path):
    with pytest.raises(vr.FormatError) as raised:
        vr.load_pipeline(written(tmp_path))
    assert str(raised.value) == (
        "mine.json: pipeline.unknown must not be there in one pipeline, got the open switches volume.slices, "
        "stepping.steps, stepping.cap; settle them, or load the set with load_candidates"
    )


@pytest.mark.parametrize(
    ("unknown", "sentence"),
    [
        ([], r"unknown must be an object of lists, got \[\]"),
        ({"slices": ["count"]}, r"unknown must name switches as group.switch, got 'slices'"),
        ({"volume.slice": ["count"]}, r"unknown must name switches as group.switch, got 'volume.slice'"),
        ({"volume.slices": "count"}, r"unknown.volume.slices must be a list of values, got 'count'"),
        (
            {"volume.slices": []},
            r"unknown.volume.slices must be a list of values, got \[\]; name at least one",
        ),
        ({"volume.slices": ["half"]}, r"unknown.volume.slices must be .*, got 'half'"),
        ({"stepping.steps": [0]}, r"unknown.stepping.steps must be a whole number from 1 to .*, got 0"),
        ({"stepping.steps": [None]}, r"unknown.stepping.steps must be a whole number"),
        ({"stepping.steps": [5, 5]}, r"unknown.stepping.steps must have each value once, got 5 twice"),
    ],
)
def test_open_switches_that_cannot_be_are_refused(unknown, sentence, tmp_path):
    with pytest.raises(vr.FormatError, match=f"^mine.json: {sentence}"):
        vr.load_candidates(written(tmp_path, unknown=unknown))


def test_combinations_that_break_a_rule_together_are_left_out():
    found = vr.Candidates(Pipeline("x"), {"output.low": (0.0, 0.6), "output.mid": (0.5, 0.7)})
    assert found.count == 4
    assert [(p.output.low, p.output.mid) for p in found] == [(0.0, 0.5), (0.0, 0.7), (0.6, 0.7)]


def test_steps_that_go_nowhere_are_left_out():
    found = vr.Candidates(vr.pipelines()["x3dom"], {"stepping.advance": ("add", "multiply", "parameter")})
    assert [one.stepping.advance for one in found] == ["add"]
