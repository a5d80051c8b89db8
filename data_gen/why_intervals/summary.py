"""What the records say, counted."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from data_gen.why_intervals.criteria import CRITERIA, RISES, Criterion
from data_gen.why_intervals.records import Record

# A fault is visible where it moves a byte of the same machine's picture by so much.  A difference of 1 is
# what rounding makes between any two machines: no criterion can be asked to fail it.
VISIBLE = 2


@dataclass(frozen=True)
class Column:
    """Something that judges images: its name, its rule in words, and whether it rejects an image."""

    name: str
    rule: str
    rejects: Callable[[Record], bool]


@dataclass(frozen=True)
class Tally:
    """How many images with a visible fault are rejected, and how many correct ones."""

    caught: int
    faulty: int
    failed: int
    correct: int


def _rejecting(criterion: Criterion) -> Callable[[Record], bool]:
    return lambda record: not criterion.passes(record.measures)


COLUMNS = (
    *(Column(one.name, one.rule, _rejecting(one)) for one in CRITERIA),
    Column("volref, any machine", "inside the intervals of a set", lambda record: record.any.caught),
    Column("volref", "inside the intervals of the machine", lambda record: record.known.caught),
)


def visible(records: Sequence[Record]) -> list[Record]:
    """Return the images whose fault shows."""
    return [record for record in records if record.kind == "fault" and record.apart >= VISIBLE]


def hidden(records: Sequence[Record]) -> list[Record]:
    """Return the images whose fault does not show."""
    return [record for record in records if record.kind == "fault" and record.apart < VISIBLE]


def correct(records: Sequence[Record]) -> list[Record]:
    """Return the images without a fault."""
    return [record for record in records if record.kind == "correct"]


def tally(column: Column, records: Sequence[Record]) -> Tally:
    """Return how a column judges the images."""
    faulty, right = visible(records), correct(records)
    caught, failed = (sum(map(column.rejects, images)) for images in (faulty, right))
    return Tally(caught, len(faulty), failed, len(right))


def shares(column: Column, records: Sequence[Record], keys: Sequence[str]) -> list[float | None]:
    """Return the part of the scenes in which a column catches each fault, None where it shows in none."""
    faulty = visible(records)
    found = []
    for key in keys:
        images = [record for record in faulty if record.name == key]
        found.append(sum(map(column.rejects, images)) / len(images) if images else None)
    return found


def keys_of(records: Sequence[Record]) -> list[str]:
    """Return the faults that are drawn, in the order of the table of faults."""
    from volref.oracle.faults.table import FAULTS

    drawn = {record.name for record in records if record.kind == "fault"}
    return [key for key in FAULTS if key in drawn]


@dataclass(frozen=True)
class Best:
    """The strictest threshold of a measure that passes all correct images, and what it catches."""

    measure: str
    threshold: float
    caught: int
    faulty: int


def best_thresholds(records: Sequence[Record]) -> list[Best]:
    """Return for each measure what any threshold could do that fails no correct image."""
    found = []
    faulty, right = visible(records), correct(records)
    for measure, rises in RISES.items():
        sign = -1 if rises else 1
        limit = max(sign * record.measures[measure] for record in right)
        caught = sum(sign * record.measures[measure] > limit for record in faulty)
        found.append(Best(measure, sign * limit, caught, len(faulty)))
    return found
