"""Faults of what the volume's texture holds and how it is read: rows F of the table."""

import numpy as np

from volref.arrays import Floats
from volref.emulation.textures.uploads import domain_of
from volref.image import decode_srgb
from volref.oracle.faults.fault import Subject
from volref.oracle.faults.making import (
    fault,
    grid_of,
    has_grid,
    replaced,
    switched,
    switching,
    with_volume,
)


def _uploaded(subject: Subject) -> Floats:
    """Return what a program uploads of the voxels, 0..1 (nz, ny, nx)."""
    low, high = domain_of(subject.scene, subject.pipeline)
    unit = np.clip((grid_of(subject).values.astype(np.float64) - low) / (high - low), 0.0, 1.0)
    return np.rint(255 * unit) / 255 if subject.pipeline.volume.format == "unorm8" else unit


def _with_uploaded(subject: Subject, unit: Floats) -> Subject:
    low, high = domain_of(subject.scene, subject.pipeline)
    return with_volume(subject, values=low + (high - low) * unit)


def _decoded(subject: Subject, _: float) -> Subject:
    """Return a subject whose texture takes its voxels for sRGB codes and reads light."""
    changed = _with_uploaded(subject, decode_srgb(_uploaded(subject)))
    # Texels are light after they are read: bytes of light would be coarser.
    bytes_ = subject.pipeline.volume.format == "unorm8"
    return switched(changed, volume={"format": "float"}) if bytes_ else changed


def _squared(subject: Subject, _: float) -> Subject:
    """Return a subject whose voxels are multiplied by an alpha that holds the same values."""
    return _with_uploaded(subject, _uploaded(subject) ** 2)


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
    fault("F3-srgb-upload", "values are taken for sRGB codes when they are read", _decoded, where=has_grid),
    fault(
        "F3-premultiplied-upload",
        "values are multiplied by an alpha that holds them too when they are uploaded",
        _squared,
        where=has_grid,
    ),
    fault(
        "F4-no-data",
        "voxels without data, those of the least value, are read as another value",
        _filled,
        where=has_grid,
        strengths=(1.0, 0.0),
    ),
)
