"""`main`: from words to a verb, and from its errors to one line and an exit status.

0 good    1 differs, or a tolerance is not met    2 bad use    130 interrupted    141 broken pipe
"""

import argparse
import difflib
import io
import os
import re
import sys
from collections.abc import Sequence
from typing import NoReturn

from volref.cli import (
    accept,
    budget,
    charts,
    check,
    compare,
    convert,
    demo,
    emulate,
    explain,
    golden,
    info,
    pipelines,
    plan,
    precision,
    probe,
    render,
    report,
    stability,
    trace,
    web,
)
from volref.cli.output import refuse
from volref.cli.verb import BAD_USE, GOOD, example_lines
from volref.errors import FormatError, SceneError

VERBS = (
    demo.VERB,
    render.VERB,
    plan.VERB,
    trace.VERB,
    emulate.VERB,
    pipelines.VERB,
    accept.VERB,
    budget.VERB,
    check.VERB,
    explain.VERB,
    compare.VERB,
    charts.VERB,
    golden.VERB,
    probe.VERB,
    info.VERB,
    convert.VERB,
    precision.VERB,
    stability.VERB,
    web.VERB,
    report.VERB,
)

# As a shell reports a program that the signals SIGINT and SIGPIPE ended.
INTERRUPTED, BROKEN_PIPE = 128 + 2, 128 + 13

PURPOSE = "volref: reference images for GPU volume renderers, with how far from the truth they may be."

EXAMPLES = (
    ("demo", "start here: a head MRI with its white matter, its error and its time, on one page"),
    ("render scene.json -o image.png", "the image of a scene"),
    ("compare image.png mine.png --diff difference.png", "how far another program's image is from it"),
    ("trace scene.json 120 80", "every number of one ray"),
)

STATUSES = "exit status: 0 good, 1 differs or tolerance not met, 2 bad use (one line on stderr)"


class UsageError(Exception):
    """Words that do not make a command; the message is one line."""


class VerbHelp(argparse.RawDescriptionHelpFormatter):
    """A help text whose first column holds every verb; argparse forgets that verbs are indented by 4."""

    def __init__(self, prog: str) -> None:
        super().__init__(prog)
        self._action_max_length = 4 + max(len(verb.name) for verb in VERBS)


class Parser(argparse.ArgumentParser):
    """An argument parser whose errors are one line with a cure."""

    def error(self, message: str) -> NoReturn:
        """Raise `UsageError`, with the nearest option where one was mistyped.

        Raises
        ------
        UsageError
            Always.
        """
        cure = f"see: {self.prog} --help"
        unknown = re.search(r"unrecognized arguments: (--[\w-]+)", message)
        if unknown:
            known = re.findall(r"--[\w-]+", self.format_help())
            close = difflib.get_close_matches(unknown[1], known, n=1)
            cure = f"did you mean {close[0]}?" if close else cure
        line = f"{message}; {cure}"
        raise UsageError(line)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command `volref` with the words `argv` (default: of this process); return its exit status."""
    words = sys.argv[1:] if argv is None else list(argv)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a file name may hold what the terminal cannot show
            stream.reconfigure(errors="backslashreplace")
    try:
        status = _run(words)
        sys.stdout.flush()
    except (UsageError, SceneError, FormatError) as error:
        refuse(str(error))
    except BrokenPipeError:
        # Nobody reads any more; without this Python complains again when it closes the stream.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE
    except OSError as error:
        refuse(f"{error.filename or 'the system'}: {error.strerror or error}")
    except MemoryError as error:
        refuse(f"not enough memory: {error or 'none is left'}; use a smaller --size or volume")
    except KeyboardInterrupt:
        refuse("interrupted; no file was left half written")
        return INTERRUPTED
    else:
        return status
    return BAD_USE


def build_parser() -> tuple[Parser, dict[str, Parser]]:
    """Return the parser of the whole command line, and that of each verb by name."""
    from volref import __version__

    parser = Parser(
        prog="volref",
        description=PURPOSE,
        epilog=f"examples:\n{example_lines(EXAMPLES)}\n\n`volref VERB --help` has more.  {STATUSES}",
        formatter_class=VerbHelp,
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"volref {__version__}")
    group = parser.add_subparsers(title="verbs", dest="verb", metavar="VERB", required=True)
    verbs = {}
    for verb in VERBS:
        notes = f"\n\n{verb.notes}" if verb.notes else ""
        verbs[verb.name] = group.add_parser(
            verb.name,
            help=verb.purpose,
            description=verb.purpose[0].upper() + verb.purpose[1:] + ".",
            epilog=f"examples:\n{example_lines(verb.examples)}{notes}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
            allow_abbrev=False,
        )
        verb.arguments(verbs[verb.name])
        verbs[verb.name].set_defaults(run=verb.run)
    return parser, verbs


def _run(words: list[str]) -> int:
    parser, verbs = build_parser()
    if not words:
        parser.print_help()
        return GOOD
    if words[0] not in (*verbs, "-h", "--help", "--version"):
        close = difflib.get_close_matches(words[0], verbs, n=1)
        cure = f"did you mean 'volref {close[0]}'?" if close else "see: volref --help"
        message = f"the verb must be one of {', '.join(verbs)}, got {words[0]!r}; {cure}"
        raise UsageError(message)
    try:
        options, rest = parser.parse_known_args(words)
        if rest:  # asked of the verb's own parser, which knows its options
            verbs[options.verb].error(f"unrecognized arguments: {' '.join(rest)}")
    except SystemExit as stop:  # --help and --version have printed what they had to
        return int(stop.code or GOOD)
    status: int = options.run(options)
    return status
