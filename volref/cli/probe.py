"""`volref probe`: what a machine does where WebGL leaves it free, from its images of tiny scenes."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from volref.cli.options import add_force, add_json
from volref.cli.output import note, print_json
from volref.cli.verb import DIFFERS, GOOD, Verb

if TYPE_CHECKING:
    from volref.golden.probing.judging import Finding, Fingerprint


def _arguments(parser: argparse.ArgumentParser) -> None:
    actions = parser.add_subparsers(title="what to do", metavar="WHAT", required=True)
    drawn = "write the scenes that are to be drawn"
    charts = actions.add_parser("charts", help=drawn, description=drawn, allow_abbrev=False)
    charts.add_argument("output", metavar="OUT", help="folder to write to")
    charts.set_defaults(act=_write)
    told = "tell the machine from the images that it drew, answer.png in each folder"
    judge = actions.add_parser("judge", help=told, description=told, allow_abbrev=False)
    judge.add_argument("folder", metavar="FOLDER", help="what `probe charts` wrote, with the answers")
    judge.add_argument("-o", "--output", metavar="FILE", help="device to write (.json), for --device")
    judge.set_defaults(act=_judge)
    for action in (charts, judge):
        add_force(action)
        add_json(action)


def _run(options: argparse.Namespace) -> int:
    status: int = options.act(options)
    return status


def _write(options: argparse.Namespace) -> int:
    from volref.golden.probing.files import write_probes

    folders = [str(folder) for folder in write_probes(options.output, overwrite=options.force)]
    if options.json:
        print_json({"folders": folders})
    else:
        note(f"wrote {len(folders)} probes to {options.output}; draw each, save it there as answer.png")
    return GOOD


def _judge(options: argparse.Namespace) -> int:
    from volref.golden.probing.files import answers_in
    from volref.golden.probing.judging import fingerprint
    from volref.io.atomic import check_free, write_text

    if options.output is not None:
        check_free(Path(options.output), overwrite=options.force)
    found = fingerprint(answers_in(options.folder))
    if options.output is not None:
        write_text(Path(options.output), found.device.to_json(), overwrite=options.force)
    if options.json:
        print_json(_document(found))
    else:
        print("\n".join(_lines(found)))
    if options.output is not None:
        note(f"wrote {options.output}; give it to --device")
    return GOOD if found.settled else DIFFERS


def _lines(found: "Fingerprint") -> list[str]:
    if found.way is None:
        return [
            "delivery     in no known way: neither upright nor upside down, whatever its alpha and encoding"
        ]
    way = found.way
    head = f"{'delivery':<12} first row at the {way.first_row}, alpha {way.alpha}, encoding {way.encoding}"
    rows = [f"{name:<12} {_words(finding)}" for name, finding in found.findings.items()]
    known = " or ".join(found.machines) or "no machine that is known"
    wrong = [name for name, share in found.confirmed.items() if share]
    last = f"not inside its own intervals: {', '.join(wrong)}" if wrong else "all inside its own intervals"
    return [head, *rows, f"{'machine':<12} as {known}", f"{'judged':<12} {last}"]


def _words(finding: "Finding") -> str:
    if len(finding.fitting) == 1:
        return finding.fitting[0]
    if finding.fitting:
        return "unknown: " + ", or ".join(finding.fitting)
    share = finding.outside[finding.nearest]
    return f"none of the answers known; nearest, {share:.1%} outside: {finding.nearest}"


def _document(found: "Fingerprint") -> dict[str, Any]:
    way = found.way
    return {
        "delivery": way and {"first_row": way.first_row, "alpha": way.alpha, "encoding": way.encoding},
        "findings": {
            name: {"facts": dict(one.facts), "fitting": list(one.fitting), "outside": dict(one.outside)}
            for name, one in found.findings.items()
        },
        "machines": list(found.machines),
        "confirmed": dict(found.confirmed),
        "device": found.device.as_dict(),
        "settled": found.settled,
    }


VERB = Verb(
    "probe",
    "how a machine filters, snaps and blends, from what it draws",
    (
        ("probe charts probes/", "write the scenes; draw each, and save it as answer.png beside it"),
        ("probe judge probes/ -o mine.json", "what the images tell, and a device for --device"),
    ),
    _arguments,
    _run,
    notes="Exit status 1: no known machine draws these images.",
)
