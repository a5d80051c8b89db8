"""What `trace` returns: one ray in full, of an integrator or of an emulated program."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from volref.arrays import Numbers, whole_number
from volref.errors import SceneError


class Column(NamedTuple):
    """A column of the table: how many numbers a row has in it, what they are, whether the table shows it.

    Of other columns only the JSON has the numbers, and how many there are is for it to say.
    """

    numbers: int
    meaning: str
    shown: bool = True


@dataclass(frozen=True, eq=False)
class Trace:
    """One ray in full.

    Parameters
    ----------
    head
        Plain data: pixel, entry, end, result and what else there is one of.
    table
        Name to array (S,) or (S, columns), in the order of the columns.
    columns
        What the columns are, by name.
    rows
        What a row is: "segments" of an integrator, "iterations" of a program's loop.
    """

    head: dict[str, Any]
    table: dict[str, Numbers]
    columns: Mapping[str, Column]
    rows: str = "segments"

    def as_dict(self) -> dict[str, Any]:
        """Return the trace as plain data for JSON; what is infinite or not a number is null."""
        rows = {name: plain(column) for name, column in self.table.items()}
        return {**self.head, "columns": {name: self.columns[name].meaning for name in rows}, self.rows: rows}

    def to_json(self) -> str:
        """Return the trace as JSON text."""
        return json.dumps(self.as_dict(), allow_nan=False)

    def __str__(self) -> str:
        """Return the trace as a table for people, the widest columns left to the JSON."""
        lines = [f"{name}: {_words(value)}" for name, value in self.head.items()]
        shown = [name for name in self.table if self.columns[name].shown]
        if not shown:
            return "\n".join(lines)
        lines.append("  ".join(f"{name:>{12 * self.columns[name].numbers}}" for name in shown))
        for row in range(len(self.table[shown[0]])):
            cells = [f"{number:12.6g}" for name in shown for number in np.atleast_1d(self.table[name][row])]
            lines.append("".join(cells))
        return "\n".join(lines)


def plain(numbers: Numbers) -> list[Any]:
    """Return an array as nested lists, numbers that JSON does not have as None.

    Examples
    --------
    >>> plain(np.array([[1.0, np.nan], [np.inf, 0.25]]))
    [[1.0, None], [None, 0.25]]
    """
    kept = numbers.astype(object)
    kept[~np.isfinite(numbers)] = None
    rows: list[Any] = kept.tolist()
    return rows


def checked_pixel(pixel: Sequence[int], width: int, height: int) -> tuple[int, int]:
    """Return column and row of a pixel, from 0 at the top left.

    Raises
    ------
    SceneError
        If it is none of an image of that size.
    """
    if not isinstance(pixel, Sequence) or len(pixel) != 2:
        message = f"pixel must be two numbers x, y, got {pixel!r}; count from the top left, from 0"
        raise SceneError(message)
    x = whole_number("pixel x", pixel[0], low=0, high=width - 1)
    return x, whole_number("pixel y", pixel[1], low=0, high=height - 1)


def _words(value: object) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{name} {_words(part)}" for name, part in value.items())
    if isinstance(value, list):
        return " ".join(map(_words, value))
    return f"{value:.6g}" if isinstance(value, float) else str(value)
