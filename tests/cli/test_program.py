"""The command line as a whole: help, typos, errors, streams, signals."""

import json
import os
import shlex
import signal
import subprocess
import sys

import numpy as np
import pytest

import volref
from tests.bad_files import BAD_FILES, scene_document
from tests.scenes import rough_scene
from volref import FormatError, save_scene
from volref.cli import main
from volref.cli.program import VERBS

NAMES = [verb.name for verb in VERBS]
COMMAND = [sys.executable, "-m", "volref"]


def refused(capsys, *words):
    """Run a command that must be refused; return its one line."""
    assert main([str(word) for word in words]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("volref: ")
    assert err.count("\n") == 1
    assert err.endswith("\n")
    return err


# --- help


def test_no_words_print_the_help(capsys):
    assert main([]) == 0
    alone = capsys.readouterr()
    assert main(["--help"]) == 0
    asked = capsys.readouterr()
    assert alone.out == asked.out
    assert alone.err == ""
    for name in NAMES:
        assert f"    {name} " in alone.out
    assert "exit status: 0 good, 1 differs" in alone.out


@pytest.mark.parametrize("verb", VERBS, ids=NAMES)
def test_the_help_of_a_verb_has_its_purpose_and_an_example_to_copy(verb, capsys):
    assert main([verb.name, "--help"]) == 0
    out = capsys.readouterr().out
    assert verb.purpose[1:] in out
    assert f"\n  volref {verb.name}" in out[out.index("examples:") :]


@pytest.mark.parametrize("verb", VERBS, ids=NAMES)
def test_the_examples_of_a_verb_can_be_parsed(verb):
    from volref.cli.program import build_parser

    parser, _ = build_parser()
    for line, _ in verb.examples:
        words = shlex.split(line.split(" > ")[0])
        assert parser.parse_args(words).run is verb.run


def test_the_version_is_that_of_the_package(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"volref {volref.__version__}\n"


# --- typos


@pytest.mark.parametrize(("typo", "verb"), [("rendr", "render"), ("comapre", "compare"), ("traces", "trace")])
def test_a_mistyped_verb_suggests_the_nearest(typo, verb, capsys):
    assert f"did you mean 'volref {verb}'?" in refused(capsys, typo, "scene.json")


def test_a_word_like_no_verb_lists_them_all(capsys):
    line = refused(capsys, "zzz")
    assert all(name in line for name in NAMES)


def test_a_mistyped_option_suggests_the_nearest(capsys):
    line = refused(capsys, "render", "scene.json", "-o", "x.png", "--treads", "2")
    assert "did you mean --threads?" in line


def test_options_are_not_abbreviated(capsys):
    assert "unrecognized arguments: --thread 2" in refused(capsys, "plan", "s.json", "--thread", "2")
    line = refused(capsys, "render", "s.json", "-o", "x.png", "--thread", "2")
    assert line == "volref: unrecognized arguments: --thread 2; did you mean --threads?\n"


@pytest.mark.parametrize(
    ("words", "fragment"),
    [
        (("--json",), "the verb must be one of demo, render, "),
        (("--size", "3x3", "plan", "s.json"), "got '--size'"),
        (("render",), "SCENE"),
        (("render", "s.json"), "-o/--output"),
        (
            ("render", "s.json", "-o", "x.png", "--size", "12"),
            "must be WIDTHxHEIGHT in pixels such as 640x480, got '12'",
        ),
        (
            ("render", "s.json", "-o", "x.png", "--step", "fine"),
            "must be a number such as 0.002 or 1/510, got 'fine'",
        ),
        (("render", "s.json", "-o", "x.png", "-j", "many"), "--threads"),
        (("trace", "s.json", "1"), "Y"),
        (("trace", "s.json", "1.5", "2"), "argument X"),
        (("info", "a.raw", "-D", "size"), "must be KEY=VALUE such as spacing=1,1,2, got 'size'"),
        (("plan", "s.json", "--max-bytes", "lots"), "must be a number of bytes such as 500M or 4G"),
        (("convert", "a.npy", "b.npz", "--nan", "inf"), "'refuse' or the number"),
    ],
)
def test_words_that_make_no_command_are_refused_with_one_line(words, fragment, capsys):
    line = refused(capsys, *words)
    assert fragment in line
    assert "--help" in line


# --- bad files


def words_for(case, path):
    """Return the command that reads the file of a case."""
    if case.kind == "scene":
        return ["plan", path]
    if case.kind == "transfer":
        return ["plan", scene_that_names(path, case.statement)]
    if case.kind == "image":
        return ["compare", path, path]
    if case.kind == "mesh":
        return ["info", path]
    told = {key: np.asarray(value).tolist() for key, value in case.statement.items()}
    return [
        "convert",
        path,
        path.with_name("converted.npz"),
        *(f"-D{k}={json.dumps(v)}" for k, v in told.items()),
    ]


def scene_that_names(path, statement):
    """Write a good scene but for the transfer function at `path` beside it."""
    np.save(path.with_name("good.npy"), np.zeros((2, 2, 2), np.uint8))
    transfer = {"path": path.name, **statement}
    document = scene_document(volume={"path": "good.npy"}, transfer=transfer)
    path.with_name("good.json").write_text(json.dumps(document))
    return path.with_name("good.json")


READ_BY_THE_COMMAND_LINE = [
    case for case in BAD_FILES if not {"max_bytes", "nan", "encoding", "alpha"} & set(case.statement)
]


@pytest.mark.parametrize("case", READ_BY_THE_COMMAND_LINE, ids=lambda case: f"{case.kind}: {case.name}")
def test_a_bad_file_ends_in_one_line(case, tmp_path, capsys):
    line = refused(capsys, *words_for(case, case.build(tmp_path)))
    assert "Traceback" not in line
    assert not (tmp_path / "converted.npz").exists()


def test_a_file_that_may_not_be_read_ends_in_one_line(capsys, monkeypatch):
    def denied(*_, **__):
        raise PermissionError(13, "Permission denied", "secret.json")

    monkeypatch.setattr("volref.io.load_scene", denied)
    assert refused(capsys, "plan", "secret.json") == "volref: secret.json: Permission denied\n"


def test_running_out_of_memory_ends_in_one_line(capsys, monkeypatch):
    def full(*_, **__):
        raise MemoryError

    monkeypatch.setattr("volref.io.load_scene", full)
    assert "not enough memory" in refused(capsys, "plan", "scene.json")


@pytest.mark.parametrize(
    ("python", "option"),
    [
        (
            "a.png must not exist yet; choose another name, or pass overwrite=True (--force)",
            "or pass --force\n",
        ),
        ("a.npy must need less; pass max_bytes=123 to allow it", "pass --max-bytes 123 to allow it\n"),
        ("path must stay inside; copy it or pass allow_outside=True", "pass --allow-outside\n"),
        ("step must be stated; pass step=", "pass --step\n"),
    ],
)
def test_a_cure_is_said_in_words_of_the_command_line(python, option, capsys, monkeypatch):
    def fail(*_, **__):
        raise FormatError(python)

    monkeypatch.setattr("volref.io.load_scene", fail)
    assert refused(capsys, "plan", "scene.json").endswith(option)


def test_those_cures_stand_in_the_errors_of_the_library(scene_file, tmp_path, capsys):
    (tmp_path / "there.png").touch()
    line = refused(capsys, "render", scene_file, "-o", tmp_path / "there.png")
    assert line.endswith("pass --force\n")
    line = refused(capsys, "plan", scene_file, "--max-bytes", "8")
    assert "pass --max-bytes 1680 to allow it" in line
    document = json.loads((tmp_path / "scene.json").read_text())
    inner = tmp_path / "inner"
    inner.mkdir()
    document["volume"]["path"] = "../scene.volume.npy"
    (inner / "scene.json").write_text(json.dumps(document))
    assert "pass --allow-outside" in refused(capsys, "plan", inner / "scene.json")
    assert main(["plan", str(inner / "scene.json"), "--allow-outside"]) == 0


# --- the real thing, in a process of its own


def test_python_dash_m_is_the_same_command():
    done = subprocess.run([*COMMAND, "--version"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, f"volref {volref.__version__}\n", "")


def test_a_bad_scene_ends_a_process_with_status_2_and_one_line(tmp_path):
    done = subprocess.run(
        [*COMMAND, "plan", "none.json"], capture_output=True, text=True, cwd=tmp_path, check=False
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "volref: none.json must be a file that exists, got no such file; check the path\n"


def test_a_reader_that_leaves_early_is_no_error(scene_file):
    process = subprocess.Popen(
        [*COMMAND, "trace", scene_file, "12", "8", "--step", "2e-3", "--json"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    process.stdout.read(10)
    process.stdout.close()
    assert process.stderr.read() == b""
    process.stderr.close()
    assert process.wait() == 128 + signal.SIGPIPE


def test_a_reader_that_never_listened_is_no_error_either():
    read_end, write_end = os.pipe()
    os.close(read_end)
    # With a buffer, as usual: the pipe is found broken only when the last words are flushed.
    buffered = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    words = [*COMMAND, "report"]
    done = subprocess.run(words, stdout=write_end, stderr=subprocess.PIPE, env=buffered, check=False)
    os.close(write_end)
    assert (done.returncode, done.stderr) == (128 + signal.SIGPIPE, b"")


def test_ctrl_c_ends_in_one_line_and_leaves_no_file(tmp_path):
    save_scene(rough_scene(256, 192), tmp_path / "scene.json")
    before = sorted(tmp_path.iterdir())
    out = tmp_path / "image.npy"
    program = (
        "import sys, volref.cli, volref.truth.integration as integration\n"
        "march = integration.march_chunk\n"
        "def told(*words):\n"
        "    print('marching', flush=True)\n"
        "    return march(*words)\n"
        "integration.march_chunk = told\n"
        "sys.exit(volref.cli.main())\n"
    )
    words = ["render", str(tmp_path / "scene.json"), "-o", str(out), "--step", "0.005", "-j", "1"]
    process = subprocess.Popen(
        [sys.executable, "-c", program, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "marching\n"
    process.send_signal(signal.SIGINT)
    _, err = process.communicate()
    assert process.returncode == 130
    assert err == "volref: interrupted; no file was left half written\n"
    assert sorted(tmp_path.iterdir()) == before
