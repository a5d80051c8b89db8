"""The page docs/faults.md."""

from collections.abc import Mapping

from data_gen.faults.figures import Figures
from data_gen.faults.seen import SEEN, row_of
from volref.golden.confusion import Told
from volref.oracle.faults.fault import Fault

HEAD = """# Faults

Faults of real renderers, each a named change of a program with a strength: `explain` tries them on an image
that leaves its acceptance intervals. This page tells which of them the [charts](guide/charts.md) catch and
tell apart. One command computes and writes it; it takes some minutes:

    $ python -m data_gen.faults

Every fault that a chart's program can have, at the first strength that it is listed with, is drawn in bytes
by a machine with float32 colours, 8 fraction bits in the weights of its filters, and corners of triangles
on a grid of 1/256 pixel. The image is held against the intervals of such a machine, of which filter and
snapping are known, as `volref probe` tells them, and the rest is not; and against the set `webgl-highp`,
for which nobody has to know anything.

- *Caught*: the image leaves the intervals of the machine; *by anyone*: those of the set, too.
- *Size*: the largest difference from the clean program, in 1/255.
- *Named*: the fault explains the image best, of all faults at all their strengths. *Tied* are those that
  explain it equally well, to half a percent: there they draw the same image.

"""

TABLE = """## The table

The chart is the one that shows the fault best; `A1` to `N1` are the rows in which faults of one kind stand,
`seen in` is where the kind was met.

| fault | what is wrong | seen in | chart | size | caught | by anyone | named |
| --- | --- | --- | --- | --- | --- | --- | --- |
"""

MAP = """
## On every chart

![Faults in rows, charts in columns](images/faults-confusion.png)

Green: caught, and named alone. Yellow: named with others that draw the same image there. Orange: caught,
and another fault explains it better. Grey: the image does not leave the intervals. Dark: the chart's
program cannot have it.

"""


def page(found: Figures, faults: Mapping[str, Fault], reasons: Mapping[str, str]) -> str:
    """Return the page as Markdown; `reasons` says why some faults are not caught, or not told."""
    rows = [_row(key, found, faults[key]) for key in found.keys]
    return HEAD + _summary(found) + "\n" + TABLE + "\n".join(rows) + "\n" + MAP + _limits(found, reasons)


def _summary(found: Figures) -> str:
    all_told = [(key, told) for one in found.told.values() for key, told in one.items()]
    caught = [(key, told) for key, told in all_told if told.caught]
    first = sum(told.rank == 1 for _, told in caught)
    alone = sum(told.named == (key,) for key, told in caught)
    second = sum(told.rank <= 2 for _, told in caught)
    keys = found.keys
    shown = sum(found.told[found.best(key)][key].named == (key,) for key in keys)
    return (
        f"{len(keys)} faults on {len(found.told)} charts make {len(all_told)} images. {len(caught)} of them "
        f"leave the intervals. Of these\n{first / len(caught):.1%} have their fault at rank 1 and "
        f"{second / len(caught):.1%} at rank 2 or better; {alone / len(caught):.1%} have it there alone.\n"
        f"{shown} of the {len(keys)} faults are named alone on some chart. Clean images of that machine: "
        f"{sum(share > 0 for share in found.clean.values())} of {len(found.clean)} leave the intervals.\n"
    )


def _row(key: str, found: Figures, fault: Fault) -> str:
    chart = found.best(key)
    told = found.told[chart][key]
    by_anyone = any(key in one and one[key].outside_any > 0 for one in found.told.values())
    yes = ["yes" if one else "no" for one in (told.caught, by_anyone)]
    cells = [f"`{key}`", fault.title, SEEN[row_of(key)], f"`{chart}`", f"{told.size:.0f}", *yes]
    return f"| {' | '.join([*cells, _named(key, told)])} |"


def _named(key: str, told: Told) -> str:
    if not told.caught:
        return ""
    others = ", ".join(f"`{one}`" for one in told.named if one != key)
    if key not in told.named:
        return f"no: {others}"
    return f"tied with {others}" if others else "yes"


def _limits(found: Figures, reasons: Mapping[str, str]) -> str:
    lines = ["## What no chart tells", ""]
    lines += [f"- `{key}` leaves the intervals on no chart: {reasons[key]}." for key in found.never_caught]
    lines += [
        f"- No image with `{one}` is told from `{other}`: {reasons[f'{one} {other}']}."
        for one, other in found.never_apart
    ]
    return "\n".join([*lines, ""])
