"""`volref pipelines new`: questions about a program, and a file of the answers."""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from volref.cli.output import note, refuse
from volref.cli.programs import pipeline_at
from volref.cli.verb import GOOD
from volref.errors import FormatError, SceneError

if TYPE_CHECKING:
    from volref.emulation.files.asking import Question
    from volref.emulation.files.candidates import Candidates
    from volref.emulation.pipeline import Pipeline
    from volref.emulation.switches import Plain
    from volref.scene import Scene

HELP = (
    "answer by number or word; Enter: what is marked *; ?: a picture; unknown, or unknown A, B: leave it open"
)


def run_new(options: argparse.Namespace) -> int:
    """Ask, and write what was answered."""
    from volref.io.atomic import check_free, write_text

    output = None if options.output is None else Path(options.output)
    if output is not None:
        if output.suffix.lower() != ".json":
            message = f"{output} must end in .json, got {output.suffix!r}; rename it"
            raise FormatError(message)
        check_free(output, overwrite=options.force)
    if options.answers is None and not sys.stdin.isatty():
        message = "answers must come from a terminal, got another stdin; pass --answers FILE"
        raise FormatError(message)
    base = pipeline_at(options.base)
    stem = Path("pipeline") if output is None else output.with_suffix("")
    pictures = _Pictures(stem, _scene_at(options.scene), force=options.force)
    if options.answers is None:
        found = ask(base, stem.name, _Terminal(pictures, always=options.pictures).answer)
    else:
        found = from_file(base, stem.name, options.answers, pictures if options.pictures else None)
    _warn(found)
    text = _json(found)
    if output is None:
        sys.stdout.write(text)
        return GOOD
    write_text(output, text, overwrite=options.force)
    note(f"wrote {output}: {_summary(found)}")
    return GOOD


def ask(
    base: "Pipeline", name: str, answer: "Callable[[Question, Plain, Pipeline], tuple[Plain, ...]]"
) -> "Candidates":
    """Return the set of pipelines that answers make of a base; questions that do not matter are left out."""
    from volref.emulation.files.asking import known_of, matters, questions
    from volref.emulation.files.candidates import Candidates

    pipeline, known = base.with_switches(name), known_of(base)
    for question in questions():
        if not matters(question.name, known):
            continue
        values = answer(question, known[question.name][0], pipeline)
        known[question.name] = values
        pipeline = _settled(pipeline, question.name, values[0])
    unknown = {name: values for name, values in known.items() if len(values) > 1}
    return Candidates(_own(pipeline), unknown)


def from_file(base: "Pipeline", name: str, path: str, pictures: "_Pictures | None") -> "Candidates":
    """Return the set of pipelines that a file of answers makes of a base; what is not there has its default.

    Raises
    ------
    FormatError
        If the file is no table of answers, or an answer is none to its question.
    """
    from volref.emulation.files.asking import answered, questions
    from volref.emulation.files.documents import read_record
    from volref.emulation.switches import checked_keys

    names = [question.name for question in questions()]
    given = read_record(
        path, "set of answers", lambda document: checked_keys("answers", document, ["name", *names])
    )
    asked = set()

    def answer(question: "Question", default: "Plain", pipeline: "Pipeline") -> "tuple[Plain, ...]":
        asked.add(question.name)
        if pictures is not None:
            pictures.of(question, default, pipeline)
        if question.name not in given:
            return (default,)
        text = _spelled(given[question.name])
        try:
            return answered(question, text, default)
        except SceneError as error:
            message = f"{Path(path).name}: {error}"
            raise FormatError(message) from error

    found = ask(base, str(given.pop("name", name)), answer)
    for left in sorted(set(given) - asked):
        note(f"{left} is left out: it does not matter for the other answers")
    return found


class _Terminal:
    """A conversation on stderr and stdin."""

    def __init__(self, pictures: "_Pictures", *, always: bool) -> None:
        self.pictures = pictures
        self.always = always
        self.count = 0
        print(HELP, file=sys.stderr)

    def answer(self, question: "Question", default: "Plain", pipeline: "Pipeline") -> "tuple[Plain, ...]":
        """Put one question until it is answered."""
        from volref.emulation.files.asking import answered

        self.count += 1
        print(f"\n{_posed(self.count, question, default)}", file=sys.stderr)
        if self.always:
            self.pictures.of(question, default, pipeline)
        while True:
            print("> ", end="", file=sys.stderr, flush=True)
            line = sys.stdin.readline()
            if not line:
                message = f"answers must go on to the last question, got their end at {question.name}; "
                raise FormatError(message + "answer on, or pass --answers FILE")
            if line.strip() == "?":
                self.pictures.of(question, default, pipeline)
                continue
            try:
                values = answered(question, line, default)
                _settled(pipeline, question.name, values[0])
            except SceneError as error:
                refuse(str(error))
            else:
                return values


class _Pictures:
    """Sheets of what each choice does, beside the file that is written."""

    def __init__(self, stem: Path, scene: "Scene | None", *, force: bool) -> None:
        self.stem = stem
        self.scene = scene
        self.force = force

    def of(self, question: "Question", default: "Plain", pipeline: "Pipeline") -> None:
        """Draw and write one."""
        from volref.emulation.files.asking import choices_of
        from volref.io.png import write_png
        from volref.report.choices import choice_sheet

        values = choices_of(question.switch) or _around(default)
        sheet = choice_sheet(pipeline, question.name, values, default, self.scene)
        path = self.stem.with_name(f"{self.stem.name}.{question.name}.png")
        write_png(path, sheet, overwrite=self.force)
        note(f"picture: {path}")


def _around(default: "Plain") -> "list[Plain]":
    """Return values of a number: itself, half and twice of it."""
    if isinstance(default, int):
        return [default, max(1, default // 2), default * 2]
    return (
        [default, default / 2, default * 2] if isinstance(default, float) and default else [default, 0.5, 1.0]
    )


def _posed(number: int, question: "Question", default: "Plain") -> str:
    from volref.emulation.files.asking import choices_of
    from volref.emulation.switches import Word

    rule = question.switch.rule
    lines = [f"{number}. {question.name}: {rule.meaning}"]
    choices = choices_of(question.switch)
    for k, value in enumerate(choices, start=1):
        meaning = rule.choices.get(str(value), "") if isinstance(rule, Word) else ""
        lines.append(f"{'*' if value == default else ' '} {k}  {_spelled(value):<15} {meaning}".rstrip())
    if not choices:
        lines.append(f"* {_spelled(default)}")
    return "\n".join(lines)


def _settled(pipeline: "Pipeline", name: str, value: "Plain") -> "Pipeline":
    group, _, word = name.partition(".")
    return pipeline.with_switches(None, **{group: {word: value}})


def _own(pipeline: "Pipeline") -> "Pipeline":
    """Return a pipeline without the title and the source of the one that its defaults come from."""
    import dataclasses

    return dataclasses.replace(pipeline, title="", source="")


def _scene_at(path: str | None) -> "Scene | None":
    from volref import load_scene

    return None if path is None else load_scene(path)


def _spelled(value: object) -> str:
    """Return an answer as it is typed."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, dict) and list(value) == ["unknown"] and isinstance(value["unknown"], list):
        return "unknown " + ", ".join(map(_spelled, value["unknown"]))
    return "none" if value is None else str(value)


def _json(found: "Candidates") -> str:
    import json

    return json.dumps(found.as_dict(), indent=2) + "\n"


def _warn(found: "Candidates") -> None:
    """Say so at once where answers that do not go together leave nothing to draw."""
    from volref.emulation.agreement import check_steps

    if next(iter(found), None) is not None:
        return
    try:
        check_steps(found.pipeline.stepping)
    except SceneError as error:
        note(f"written as answered, but emulate will refuse it: {error}")


def _summary(found: "Candidates") -> str:
    if not found.unknown:
        return "every switch is settled; emulate it with --pipeline"
    return f"{len(found.unknown)} open switches, {found.count} pipelines"
