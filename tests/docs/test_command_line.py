"""What docs/ shows of the command line is what the command says."""

import contextlib
import doctest
import io
import shlex

import pytest

from tests.docs.pages import DOCS, blocks, captioned_files
from volref.cli import main
from volref.cli.program import VERBS

PAGE = DOCS / "guide" / "command_line.md"
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


def session(block):
    """Return [(words after "volref", expected output)] of a console block."""
    commands = []
    for line in block.splitlines():
        if line.startswith("$ "):
            commands.append((line[2:], []))
        else:
            commands[-1][1].append(line)
    return [(shlex.split(command), "\n".join(output)) for command, output in commands]


def run(words):
    """Return what a command prints on both streams; `echo $?` has no words but the status before it."""
    streams = io.StringIO()
    with contextlib.redirect_stdout(streams), contextlib.redirect_stderr(streams):
        status = main(words)
    return streams.getvalue(), status


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with the files of the page, after the page's Python examples."""
    monkeypatch.chdir(tmp_path)
    for name, text in captioned_files(PAGE).items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    examples = doctest.DocTestParser().get_examples(PAGE.read_text(encoding="utf-8"))
    names = {}
    for example in examples:
        exec(compile(example.source, str(PAGE), "single"), names)
    return tmp_path


@pytest.mark.usefixtures("folder")
def test_the_sessions_of_the_page_run_as_they_stand():
    status = 0
    for words, expected in [step for block in blocks(PAGE, "console") for step in session(block)]:
        if words == ["echo", "$?"]:
            got = f"{status}\n"
        else:
            assert words[0] == "volref"
            got, status = run(words[1:])
        assert doctest.OutputChecker().check_output(f"{expected}\n", got, FLAGS), f"{words} printed:\n{got}"


def test_the_page_shows_every_verb():
    shown = {words[1] for block in blocks(PAGE, "console") for words, _ in session(block) if len(words) > 1}
    assert {verb.name for verb in VERBS} <= shown
