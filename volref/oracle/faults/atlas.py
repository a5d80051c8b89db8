"""Faults of an atlas, and of the volume's texture as a whole: rows A of the table."""

import numpy as np

from volref.emulation.textures.uploads import domain_of, tiles_of
from volref.oracle.faults.fault import Subject
from volref.oracle.faults.making import (
    fault,
    grid_of,
    has_atlas,
    has_boxed_atlas,
    replaced,
    switched,
    switching,
    with_volume,
)


def _other_slice(subject: Subject, by: float) -> Subject:
    """Return a subject each of whose slices shows another; beyond the last, what the program has there."""
    values, count = grid_of(subject).values, grid_of(subject).size[2]
    shown = np.arange(count) + int(by)
    moved = values[np.clip(shown, 0, count - 1)].copy()
    if subject.pipeline.volume.second_slice == "unclamped":
        moved[shown >= count] = values.dtype.type(domain_of(subject.scene, subject.pipeline)[0])
    return with_volume(subject, values=moved)


def _without_last_slice(subject: Subject, held: float) -> Subject:
    """Return a subject that shows the last but one for the last slice; held at 2: and for all beyond it."""
    values = grid_of(subject).values.copy()
    values[-1] = values[-2]
    changed = with_volume(subject, values=values)
    if held == 1:
        return changed
    if subject.pipeline.volume.second_slice == "clamped":
        return subject
    return switched(changed, volume={"second_slice": "clamped"})


def _uneven(subject: Subject) -> bool:
    """Tell whether an atlas has more tiles one way than the other."""
    if not has_boxed_atlas(subject):
        return has_atlas(subject)
    across, down = tiles_of(subject.pipeline.volume, grid_of(subject).size[2])
    return across != down


def _several(subject: Subject) -> bool:
    return has_boxed_atlas(subject) and grid_of(subject).size[2] > 1


ATLAS = (
    fault(
        "A1-row-divisor",
        "the row of a tile is found with the number of rows where that of columns belongs",
        switching(volume={"tile_row": "rows"}),
        where=_uneven,
    ),
    fault(
        "A1-printed-row",
        "the row of a tile is fract(s / P) / P, seed 001's eq. 8 and 10",
        switching(volume={"tile_row": "printed"}),
        where=has_atlas,
    ),
    fault(
        "A1-second-column",
        "the column of the second slice's tile is floor(s2 / M), seed 001's eq. 9",
        switching(volume={"second_column": "printed"}),
        where=has_atlas,
    ),
    fault(
        "A2-slice-off-by-one",
        "the neighbour of each slice is read in its place",
        _other_slice,
        where=_several,
        strengths=(1.0, -1.0),
    ),
    fault(
        "A2-last-tile",
        "the last slice is never reached",
        _without_last_slice,
        where=_several,
        strengths=(1.0, 2.0),
    ),
    fault(
        "A3-half-slice",
        "slices lie half a slice off: at i / N where (i + 1/2) / N is meant, or the other way",
        replaced("volume", "slices", {"centers": "count", "count": "centers", "last": "centers"}),
        where=has_boxed_atlas,
    ),
    fault(
        "A3-slice-count",
        "z is multiplied by N slices where N - 1 is meant, or the other way",
        replaced("volume", "slices", {"centers": "last", "count": "last", "last": "count"}),
        where=has_boxed_atlas,
    ),
    fault(
        "A3-no-interpolation",
        "nothing is interpolated between slices",
        switching(volume={"between": "none"}),
        where=has_atlas,
    ),
    fault(
        "A3-bleeding",
        "a linear filter bleeds from a tile into its neighbour",
        switching(volume={"in_tile": "bleeds", "padding": 0}),
        where=has_atlas,
    ),
    fault(
        "A3-mix-by-x",
        "two slices are mixed by x where z belongs, seed 001's eq. 17",
        switching(volume={"between": "x"}),
        where=has_atlas,
    ),
)
