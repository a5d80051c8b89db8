"""`volref pipelines`: which programs there are, what their switches mean, and a description of one's own."""

import argparse
import json
from typing import TYPE_CHECKING, Any

from volref.cli.asking import run_new
from volref.cli.options import add_force, add_json
from volref.cli.output import print_json
from volref.cli.programs import is_file, pipeline_at
from volref.cli.verb import DIFFERS, GOOD, Verb

if TYPE_CHECKING:
    from volref.emulation.files.candidates import Candidates
    from volref.emulation.pipeline import Pipeline
    from volref.emulation.switches import Plain

PRINTED = "-printed"


def _arguments(parser: argparse.ArgumentParser) -> None:
    add_json(parser)
    parser.set_defaults(act=_list)
    actions = parser.add_subparsers(title="what to do (default: list)", metavar="WHAT")
    several = {
        "list": ("the names and titles of all", _list),
        "show": ("every switch, its value and its meaning", _show),
        "diff": ("the switches in which two differ; exit status 1 if there are any", _diff),
        "schema": ("the JSON Schema of pipeline files", _schema),
        "new": ("describe a program by answering questions", run_new),
    }
    made = {}
    for name, (purpose, act) in several.items():
        made[name] = actions.add_parser(name, help=purpose, description=purpose, allow_abbrev=False)
        made[name].set_defaults(act=act)
    for name in ("list", "show", "diff"):
        # The default is the one of the verb itself, which may come first.
        made[name].add_argument("--json", action="store_true", default=argparse.SUPPRESS)
    made["show"].add_argument("pipeline", metavar="NAME|FILE")
    for which in ("one", "other"):
        made["diff"].add_argument(which, metavar="NAME|FILE")
    _arguments_of_new(made["new"])


def _arguments_of_new(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("-o", "--output", metavar="FILE", help="file to write (.json); default stdout")
    parser.add_argument(
        "--from", dest="base", metavar="NAME|FILE", default="texture3d", help="where the defaults come from"
    )
    parser.add_argument("--scene", metavar="SCENE", help="scene of the pictures; default a small artery")
    parser.add_argument(
        "--pictures", action="store_true", help="a picture of each question's choices, unasked"
    )
    parser.add_argument(
        "--answers", metavar="FILE", help='JSON with answers, {"table.size": 512, "volume.slices": "unknown"}'
    )
    add_force(parser)


def _run(options: argparse.Namespace) -> int:
    status: int = options.act(options)
    return status


def _list(options: argparse.Namespace) -> int:
    from volref import pipelines

    if options.json:
        heads = [{"name": p.name, "title": p.title, "source": p.source} for p in pipelines().values()]
        print_json({"pipelines": heads})
        return GOOD
    width = max(map(len, pipelines()))
    for name, pipeline in pipelines().items():
        print(f"{name:<{width}}  {pipeline.title}")
    return GOOD


def _show(options: argparse.Namespace) -> int:
    found = _set_at(options.pipeline)
    document = described(found)
    if options.json:
        print_json(document)
        return GOOD
    beside = document["sibling"]
    print(f"{found.pipeline.name}: {found.pipeline.title}")
    print(f"source: {found.pipeline.source}")
    if beside:
        print(f"sibling: {beside}")
    print("* differs from the default" + (f", ! from {beside}" if beside else ""))
    group = ""
    for row in document["switches"]:
        if row["switch"].partition(".")[0] != group:
            group = row["switch"].partition(".")[0]
            print(f"\n{group}")
        print(_line(row, beside))
    return GOOD


def described(found: "Candidates") -> dict[str, Any]:
    """Return every switch of a program: value, meaning, default, and the value of its sibling."""
    from volref import pipelines
    from volref.emulation.files.asking import questions
    from volref.emulation.switches import Word

    pipeline = found.pipeline
    name = pipeline.name
    beside = name.removesuffix(PRINTED) if name.endswith(PRINTED) else name + PRINTED
    sibling = pipelines().get(beside)
    rows = []
    for question in questions():
        group, _, word = question.name.partition(".")
        value, rule = getattr(getattr(pipeline, group), word), question.switch.rule
        row = {"switch": question.name, "value": value, "meaning": rule.meaning}
        if isinstance(rule, Word) and value is not None:
            row["choice"] = rule.choices[value]
        if question.name in found.unknown:
            row["unknown"] = list(found.unknown[question.name])
        row["default"] = question.switch.default
        if sibling is not None:
            row["sibling"] = getattr(getattr(sibling, group), word)
        rows.append(row)
    head = {"name": name, "title": pipeline.title, "source": pipeline.source, "domain": pipeline.domain}
    return head | {"sibling": None if sibling is None else beside, "switches": rows}


def _line(row: dict[str, Any], beside: str | None) -> str:
    other = "sibling" in row and row["sibling"] != row["value"]
    marks = ("*" if row["value"] != row["default"] else " ") + ("!" if other else " ")
    value = "unknown: " + ", ".join(map(_word, row["unknown"])) if "unknown" in row else _word(row["value"])
    meaning = row["meaning"] + (f": {row['choice']}" if "choice" in row and "unknown" not in row else "")
    notes = [f"default {_word(row['default'])}"] if marks[0] == "*" else []
    notes += [f"{beside} {_word(row['sibling'])}"] if other else []
    line = f"{marks} {row['switch'].partition('.')[2]:<15} {value:<16} {meaning}"
    return line + (f"  [{'; '.join(notes)}]" if notes else "")


def _diff(options: argparse.Namespace) -> int:
    from volref.emulation.files.asking import questions

    one, other = (pipeline_at(text) for text in (options.one, options.other))
    rows = []
    for question in questions():
        group, _, word = question.name.partition(".")
        values = [getattr(getattr(pipeline, group), word) for pipeline in (one, other)]
        if values[0] != values[1]:
            meaning = question.switch.rule.meaning
            rows.append({"switch": question.name, "one": values[0], "other": values[1], "meaning": meaning})
    if one.domain != other.domain:
        rows.append(
            {"switch": "domain", "one": one.domain, "other": other.domain, "meaning": "values of 0 and 1"}
        )
    if options.json:
        print_json({"one": one.name, "other": other.name, "switches": rows})
    else:
        _print_differences(one, other, rows)
    return DIFFERS if rows else GOOD


def _print_differences(one: "Pipeline", other: "Pipeline", rows: list[dict[str, Any]]) -> None:
    if not rows:
        print(f"{one.name} and {other.name} have the same switches")
        return
    head = {"switch": "switch", "one": one.name, "other": other.name}
    lines = [[_word(row[key]) for key in ("switch", "one", "other")] for row in (head, *rows)]
    widths = [max(len(line[k]) for line in lines) for k in range(3)]
    for line, meaning in zip(lines, ("", *(row["meaning"] for row in rows)), strict=True):
        cells = "  ".join(f"{text:<{width}}" for text, width in zip(line, widths, strict=True))
        print(f"{cells}  {meaning}".rstrip())


def _schema(_: argparse.Namespace) -> int:
    from volref import pipeline_schema

    print(json.dumps(pipeline_schema(), indent=2))
    return GOOD


def _set_at(text: str) -> "Candidates":
    from volref import Candidates, load_candidates

    return load_candidates(text) if is_file(text) else Candidates(pipeline_at(text))


def _word(value: "Plain | tuple[float, float]") -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:g}"
    return "none" if value is None else str(value)


VERB = Verb(
    "pipelines",
    "the GPU programs that can be emulated, and a description of your own",
    (
        ("pipelines", "the names"),
        ("pipelines show congote2012-printed", "every switch, and where the print differs from what works"),
        ("pipelines diff congote2012 x3dom", "what sets two programs apart"),
        ("pipelines new -o mine.json", "describe your own renderer by answering questions"),
        ("pipelines new -o mine.json --from x3dom --answers known.json", "with answers from a file"),
        ("pipelines schema > pipeline.schema.json", "what a pipeline file may hold, for your editor"),
    ),
    _arguments,
    _run,
)
