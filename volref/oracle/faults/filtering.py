"""Faults of what the volume's texture holds and how it is read: rows F of the table."""

import numpy as np

from volref.emulation.textures.uploads import domain_of
from volref.image import decode_srgb
from volref.oracle.faults.fault import Subject
from volref.oracle.faults.making import fault, grid_of, has_grid, replaced, switching, with_volume


def _decoded(subject: Subject, _: float) -> Subject:
    """Return a subject whose voxels have been taken for sRGB codes and made light."""
    low, high = domain_of(subject.scene, subject.pipeline)
    unit = np.clip((grid_of(subject).values.astype(np.float64) - low) / (high - low), 0.0, 1.0)
    return with_volume(subject, values=low + (high - low) * decode_srgb(unit))


def _filled(subject: Subject, share: float) -> Subject:
    """Return a subject whose voxels without data, those of the least value, hold a share of the domain."""
    low, high = domain_of(subject.scene, subject.pipeline)
    values = grid_of(subject).values
    least, value = grid_of(subject).value_bounds[0], low + share * (high - low)
    if least == value:
        return subject
    return with_volume(subject, values=np.where(values == least, value, values.astype(np.float64)))


FILTERING = (
    fault("F1-nearest", "voxels are not interpolated", switching(volume={"filter": "nearest"})),
    fault(
        "F2-half-float",
        "values are squeezed into 16-bit floats",
        replaced("volume", "format", {"float": "half", "exact": "half", "unorm16-split": "half"}),
    ),
    fault(
        "F2-eight-bit",
        "values are squeezed into 8 bits",
        replaced("volume", "format", dict.fromkeys(("float", "exact", "half", "unorm16-split"), "unorm8")),
    ),
    fault(
        "F3-srgb-upload", "values are taken for sRGB codes when they are uploaded", _decoded, where=has_grid
    ),
    fault(
        "F4-no-data",
        "voxels without data, those of the least value, are read as another value",
        _filled,
        where=has_grid,
        strengths=(1.0, 0.0),
    ),
)
