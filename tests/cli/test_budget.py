"""`volref budget`: sources of error as a table or as JSON."""

import json

import pytest

import volref as vr
from tests.emulation.scenes import example
from volref.cli import main


@pytest.fixture
def run(capsys):
    def running(*words):
        status = main([str(word) for word in words])
        return status, *capsys.readouterr()

    return running


@pytest.fixture
def arguments(tmp_path):
    vr.save_scene(example(), tmp_path / "scene.json")
    program = vr.pipelines()["texture3d"].with_switches(table={"size": 8})
    (tmp_path / "mine.json").write_text(program.to_json())
    return "budget", tmp_path / "scene.json", "--pipeline", tmp_path / "mine.json", "--device", "swiftshader"


def test_the_worst_source_comes_first_and_is_said(run, arguments):
    status, out, err = run(*arguments)
    lines = out.splitlines()
    assert status == 0
    assert lines[0].split() == ["program", "texture3d", "on", "swiftshader"]
    assert lines[lines.index("sources") + 1].strip().startswith("table size (8 entries)")
    assert "change the table size first" in err


def test_json_has_what_budget_returns(run, arguments):
    status, out, err = run(*arguments, "--json")
    found = json.loads(out)
    program = vr.load_pipeline(arguments[3])
    expected = vr.budget(vr.load_scene(arguments[1]), program, "swiftshader").as_dict()
    assert (status, err) == (0, "")
    assert {**found, "seconds": 0} == {**expected, "seconds": 0}
