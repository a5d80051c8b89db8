"""What the command line knows of a verb."""

import argparse
from collections.abc import Callable
from typing import NamedTuple

GOOD, DIFFERS, BAD_USE = 0, 1, 2


class Verb(NamedTuple):
    """A verb: what it is for in one line, examples to copy, its arguments, and what runs it.

    `examples` holds (command line without "volref", what it does).  `run` returns the exit status: 0 good,
    1 differs or not met.  Whatever is dear to import, it imports itself.
    """

    name: str
    purpose: str
    examples: tuple[tuple[str, str], ...]
    arguments: Callable[[argparse.ArgumentParser], None]
    run: Callable[[argparse.Namespace], int]
    notes: str = ""


def example_lines(examples: tuple[tuple[str, str], ...]) -> str:
    """Return examples for a help text, each under what it does."""
    return "\n".join(f"  # {what}\n  volref {line}" for line, what in examples)
