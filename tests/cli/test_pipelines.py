"""`volref pipelines`: names, switches, differences, the schema, and a description of one's own."""

import io
import json

import numpy as np
import pytest
from PIL import Image

import volref as vr
from tests.emulation.scenes import HEIGHT, WIDTH, example
from volref.cli import main
from volref.cli.pipelines import described
from volref.emulation.files.asking import choices_of, known_of, matters, questions


def run(capsys, *words):
    status = main([str(word) for word in words])
    out, err = capsys.readouterr()
    return status, out, err


@pytest.fixture
def typed(monkeypatch):
    """Let a person at a terminal type lines."""

    def type_lines(*lines):
        stream = io.StringIO("".join(f"{line}\n" for line in lines))
        stream.isatty = lambda: True
        monkeypatch.setattr("sys.stdin", stream)

    return type_lines


def answers(tmp_path, **given):
    path = tmp_path / "answers.json"
    path.write_text(json.dumps({name.replace("__", "."): value for name, value in given.items()}), "utf-8")
    return path


# --- list, show, diff, schema


def test_all_programs_are_listed_with_their_titles(capsys):
    status, out, err = run(capsys, "pipelines")
    assert (status, err) == (0, "")
    assert [line.split()[0] for line in out.splitlines()] == list(vr.pipelines())
    assert run(capsys, "pipelines", "list")[1] == out
    found = json.loads(run(capsys, "pipelines", "--json")[1])["pipelines"]
    assert [one["title"] for one in found] == [one.title for one in vr.pipelines().values()]
    assert json.loads(run(capsys, "pipelines", "list", "--json")[1])["pipelines"] == found


def test_show_says_what_every_switch_is_and_marks_what_is_unusual(capsys):
    status, out, _ = run(capsys, "pipelines", "show", "congote2012-printed")
    lines = out.splitlines()
    assert status == 0
    between = next(line for line in lines if line[3:].startswith("between "))
    assert between.startswith("*! between         x ")
    assert between.endswith("as seed 001 prints eq. 17  [default z; congote2012 z]")
    assert next(line for line in lines if line[3:].startswith("rows ")).startswith(
        "   rows            with-v "
    )
    found = json.loads(run(capsys, "pipelines", "show", "congote2012-printed", "--json")[1])
    assert [row["switch"] for row in found["switches"]] == [question.name for question in questions()]
    assert all(row["meaning"] for row in found["switches"])
    assert found["sibling"] == "congote2012"


@pytest.mark.parametrize("name", vr.pipelines())
def test_every_program_can_be_shown(name, capsys):
    status, out, _ = run(capsys, "pipelines", "show", name)
    assert status == 0
    assert len(out.splitlines()) >= len(questions())
    assert described(vr.Candidates(vr.pipelines()[name]))["switches"]


def test_show_names_what_is_open_in_a_file(tmp_path, capsys):
    path = tmp_path / "mine.json"
    found = vr.Candidates(vr.pipelines()["x3dom"], {"volume.slices": ("count", "last")})
    path.write_text(json.dumps(found.as_dict()), encoding="utf-8")
    assert "slices          unknown: count, last" in run(capsys, "pipelines", "show", path)[1]


def test_diff_names_the_switches_in_which_two_differ(capsys):
    status, out, _ = run(capsys, "pipelines", "diff", "burkalo2022", "burkalo2022-printed")
    assert status == 1
    assert out.splitlines()[0].split() == ["switch", "burkalo2022", "burkalo2022-printed"]
    assert out.splitlines()[1].startswith("rays.direction  focal ")
    found = json.loads(run(capsys, "pipelines", "diff", "burkalo2022", "burkalo2022-printed", "--json")[1])
    one, other = (known_of(vr.pipelines()[name]) for name in ("burkalo2022", "burkalo2022-printed"))
    assert [row["switch"] for row in found["switches"]] == [name for name in one if one[name] != other[name]]
    same = run(capsys, "pipelines", "diff", "x3dom", "x3dom")
    assert same == (0, "x3dom and x3dom have the same switches\n", "")


def test_the_schema_is_printed_as_it_is(capsys):
    assert json.loads(run(capsys, "pipelines", "schema")[1]) == vr.pipeline_schema()


@pytest.mark.parametrize("words", [("show", "mine"), ("diff", "x3dom", "mine.json"), ("shw",)])
def test_a_name_that_there_is_not_is_refused_in_one_line(words, capsys):
    status, out, err = run(capsys, "pipelines", *words)
    assert (status, out, err.count("\n")) == (2, "", 1)


# --- new


def test_enter_takes_every_default_and_only_questions_that_matter_are_put(tmp_path, capsys, typed):
    typed(*[""] * 100)
    status, _, err = run(capsys, "pipelines", "new", "-o", tmp_path / "mine.json", "--from", "congote2012")
    assert status == 0
    mine = vr.load_pipeline(tmp_path / "mine.json")
    assert mine.name == "mine"
    assert known_of(mine) == known_of(vr.pipelines()["congote2012"])
    known = known_of(mine)
    put = [question.name for question in questions() if matters(question.name, known)]
    assert [line.split(" ")[1] for line in err.splitlines() if line[:1].isdigit()] == [f"{n}:" for n in put]
    assert {"volume.slices", "rays.format"} <= set(put)
    assert not {"rays.direction", "output.low", "meshes.packing", "volume.seam"} & set(put)


def test_answers_are_numbers_words_and_unknown(tmp_path, capsys, typed):
    """Two passes are choice 1; a wrong answer is refused in a line, and the question stays."""
    typed("1", "varying", "no way", "2", "unknown", *[""] * 100)
    status, _, err = run(capsys, "pipelines", "new", "-o", tmp_path / "mine.json")
    found = vr.load_candidates(tmp_path / "mine.json")
    assert status == 0
    assert found.pipeline.rays.kind == "coordinates"
    assert (found.pipeline.rays.front, found.pipeline.rays.no_exit) == ("varying", "left")
    assert found.unknown == {"rays.format": ("unorm8", "half", "float", "exact")}
    assert "rays.no_exit must be" in err
    assert err.rstrip().endswith("mine.json: 1 open switches, 4 pipelines")


def test_answers_come_from_a_file_and_unknown_ones_become_a_set(tmp_path, capsys):
    path = answers(
        tmp_path,
        name="ours",
        volume__layout="unknown",
        volume__slices="unknown last, count",
        stepping__opaque_at=None,
        stepping__length={"unknown": [0.25, 0.5]},
        table__srgb=True,
        output__low=0.1,
    )
    status, out, err = run(capsys, "pipelines", "new", "--answers", path)
    found = vr.Candidates.from_dict(json.loads(out))
    assert (status, found.pipeline.name, found.count) == (0, "ours", 8)
    assert found.unknown["volume.slices"] == ("last", "count")
    assert (found.pipeline.stepping.opaque_at, found.pipeline.table.srgb) == (None, True)
    assert err == "volref: output.low is left out: it does not matter for the other answers\n"


def test_a_picture_of_the_choices_is_drawn_when_it_is_asked_for(tmp_path, capsys, typed):
    vr.save_scene(example(), tmp_path / "scene.json")
    typed("?", "", *[""] * 100)
    words = ("--scene", tmp_path / "scene.json", "--from", "congote2012")
    status, _, err = run(capsys, "pipelines", "new", "-o", tmp_path / "mine.json", *words)
    picture = tmp_path / "mine.rays.kind.png"
    assert status == 0
    assert f"picture: {picture}" in err
    assert [path.name for path in tmp_path.glob("*.png")] == [picture.name]
    with Image.open(picture) as image:
        assert image.size[0] == 3 * (WIDTH + 6)
        shown = np.asarray(image)
    # What is beside the default differs from it, and the difference is drawn below.
    assert shown[HEIGHT + 2 * 14 : 2 * (HEIGHT + 14), WIDTH + 6 : 2 * WIDTH + 6].any()


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"volume.slice": "count"}, "answers must have switches it knows, got 'volume.slice'"),
        ({"volume.format": "unorm12"}, "answers.json: volume.format must be"),
        ({"table.size": "unknown"}, "answers.json: table.size must be unknown among values, got none"),
        ({"table.size": [3]}, "answers.json: table.size must be a whole number"),
    ],
)
def test_a_file_of_answers_that_cannot_be_is_refused_in_one_line(given, sentence, tmp_path, capsys):
    path = answers(tmp_path, **given)
    status, out, err = run(capsys, "pipelines", "new", "--answers", path)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert sentence in err


def test_answers_that_do_not_go_together_are_told_at_once(tmp_path, capsys):
    path = answers(tmp_path, stepping__end="parameter")
    status, out, err = run(capsys, "pipelines", "new", "--answers", path)
    assert status == 0
    assert json.loads(out)["stepping"]["end"] == "parameter"
    assert "emulate will refuse it: pipeline.stepping.advance must be 'parameter' for end 'parameter'" in err


def test_questions_need_somebody_to_answer_them(tmp_path, capsys, monkeypatch, typed):
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    status, _, err = run(capsys, "pipelines", "new")
    assert (status, err) == (
        2,
        "volref: answers must come from a terminal, got another stdin; pass --answers FILE\n",
    )
    typed("1")
    status, _, err = run(capsys, "pipelines", "new", "-o", tmp_path / "mine.json")
    assert status == 2
    assert "answers must go on to the last question, got their end at rays.front" in err
    assert not (tmp_path / "mine.json").exists()


def test_a_file_that_is_there_is_kept_unless_told_otherwise(tmp_path, capsys):
    words = ("pipelines", "new", "-o", tmp_path / "mine.json", "--answers", answers(tmp_path))
    assert run(capsys, *words)[0] == 0
    assert "must not exist yet" in run(capsys, *words)[2]
    assert run(capsys, *words, "--force")[0] == 0
    assert "must end in .json, got '.txt'" in run(capsys, "pipelines", "new", "-o", "mine.txt")[2]


def test_every_need_names_switches_that_there_are():
    from volref.emulation.files.asking import NEEDS

    names = [question.name for question in questions()]
    assert set(NEEDS) <= set(names)
    assert {other for needs in NEEDS.values() for other in needs} <= set(names)
    # A question is put after those that it hangs on.
    assert all(names.index(other) < names.index(name) for name, needs in NEEDS.items() for other in needs)
    assert all(choices_of(q.switch) for q in questions() if hasattr(q.switch.rule, "choices"))
