"""A scalar field on a regular grid, placed in the world.

Half a voxel decides where a volume ends.  Four samples along x, spacing s, origin o at sample 0:

    cell:  |--0--|--1--|--2--|--3--|     index -0.5 to 3.5, clamped beyond the outer centres
    node:     0-----1-----2-----3        index  0.0 to 3.0

so with o = 0 and s = 2 a "cell" volume reaches from x = -1 to 7 and a "node" volume from 0 to 6.
A GPU texture is "cell": texture coordinate u = (index + 1/2) / n, 0 at index -0.5 and 1 at index 3.5.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import (
    LARGEST_LENGTH,
    LEAST_LENGTH,
    Floats,
    Numbers,
    Vector,
    float_array,
    number,
    one_of,
    plain_array,
    set_fields,
)
from volref.errors import SceneError
from volref.scene.transform import affine, check_regular, invert_affine

# Above 2^53 neighbouring whole numbers are no longer distinct in float64.
LARGEST_EXACT_INTEGER = 2**53

# Bytes of voxels that are looked at together: a pass over a mapped file then needs no memory to speak of.
PART_BYTES = 1 << 20

IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True, eq=False, init=False)
class Volume:
    """A trilinearly interpolated scalar field given at grid points.

    Parameters
    ----------
    values
        Array (nz, ny, nx) of any integer or real type, in raw units (HU, dBZ, codes).  Kept as it is,
        without a copy, so a memory-mapped file stays one; do not change the array afterwards.
    spacing
        World distance (sx, sy, sz) between neighbouring samples.
    origin
        World position (x, y, z) of the centre of voxel (0, 0, 0), as in NRRD, NIfTI and ITK.
    direction
        3x3 matrix; column k is the unit vector along which index k grows.
    centering
        "cell": the extent reaches half a voxel beyond the outer samples and is clamped there, as in a
        GPU texture.  "node": the extent ends at the outer samples, as in VTK point data.
    nan
        "refuse", or the finite value that replaces NaN and infinity (in a copy).

    Raises
    ------
    SceneError
        If a field breaks one of these rules.

    Examples
    --------
    >>> volume = Volume(np.zeros((2, 3, 4), np.uint8), spacing=(2, 1, 1))
    >>> volume.size, volume.index_bounds[0].tolist(), volume.index_bounds[1].tolist()
    ((4, 3, 2), [-0.5, -0.5, -0.5], [3.5, 2.5, 1.5])
    """

    values: Numbers
    spacing: Vector
    origin: Vector
    direction: Floats
    centering: str

    def __init__(
        self,
        values: Numbers,
        spacing: ArrayLike = (1.0, 1.0, 1.0),
        origin: ArrayLike = (0.0, 0.0, 0.0),
        direction: ArrayLike = IDENTITY,
        centering: str = "cell",
        *,
        nan: str | float = "refuse",
    ) -> None:
        one_of("volume.centering", centering, ("cell", "node"))
        set_fields(
            self,
            values=_checked_values(values, centering, nan),
            spacing=_positive_spacing(spacing),
            origin=tuple(float_array("volume.origin", origin, (3,), limit=LARGEST_LENGTH).tolist()),
            direction=_unit_columns(direction),
            centering=centering,
        )

    @property
    def size(self) -> tuple[int, int, int]:
        """Number of samples (nx, ny, nz)."""
        nz, ny, nx = self.values.shape
        return nx, ny, nz

    @cached_property
    def world_from_index(self) -> Floats:
        """4x4 matrix from index space (integer = voxel centre) to the world."""
        return affine(self.direction * np.array(self.spacing), np.array(self.origin))

    @cached_property
    def index_from_world(self) -> Floats:
        """4x4 matrix from the world to index space."""
        return invert_affine("volume.direction", self.world_from_index)

    @cached_property
    def index_bounds(self) -> tuple[Floats, Floats]:
        """Lowest and highest index point (x, y, z) of the extent."""
        margin = 0.5 if self.centering == "cell" else 0.0
        return np.full(3, -margin), np.array(self.size, dtype=np.float64) - 1.0 + margin

    @cached_property
    def corners(self) -> Floats:
        """The eight world corners of the extent, (8, 3)."""
        low, high = self.index_bounds
        choice = np.array(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij")).reshape(3, 8).T
        index = np.where(choice == 1, high, low)
        return index @ self.world_from_index[:3, :3].T + self.world_from_index[:3, 3]

    @cached_property
    def value_bounds(self) -> tuple[float, float]:
        """Least and greatest value; every interpolated value lies between them."""
        return _least_and_greatest(self.values)


def _positive_spacing(spacing: ArrayLike) -> Vector:
    array = float_array("volume.spacing", spacing, (3,), limit=LARGEST_LENGTH)
    if not (array > 0).all():
        message = f"volume.spacing must be positive, got {array.tolist()}; "
        raise SceneError(message + "give the distance between samples and flip an axis by volume.direction")
    number("volume.spacing", array.min(), low=LEAST_LENGTH)
    return tuple(array.tolist())


def _unit_columns(direction: ArrayLike) -> Floats:
    array = float_array("volume.direction", direction, (3, 3))
    check_regular("volume.direction", array)
    lengths = np.linalg.norm(array, axis=0)
    # 1e-4: readers hand on float32 headers, printed with five digits in some formats.
    if not np.allclose(lengths, 1.0, rtol=0.0, atol=1e-4):
        message = f"volume.direction must have columns of length 1, got lengths {lengths.tolist()}; "
        raise SceneError(message + "move the lengths into volume.spacing")
    return array


def _checked_values(values: Numbers, centering: str, nan: str | float) -> Numbers:
    array = plain_array("volume.values", values)
    least = 2 if centering == "node" else 1
    if array.ndim != 3 or min(array.shape) < least:
        message = f"volume.values must have shape (nz, ny, nx), each at least {least} for {centering!r} "
        message += f"centering, got {array.shape}; "
        raise SceneError(message + "select one scalar 3-D field, z first")
    if array.dtype.kind not in "iuf":
        message = f"volume.values must be integers or real numbers, got {array.dtype}; "
        raise SceneError(message + "convert them, for labels and masks to uint8 or float32")
    if array.dtype.itemsize > 8:
        message = f"volume.values must have at most 8 bytes each, got {array.dtype}; "
        raise SceneError(message + "convert them to float64")
    if not array.dtype.isnative:
        array = array.astype(array.dtype.newbyteorder("="))
    array = _finite_values(array, nan) if array.dtype.kind == "f" else array
    _refuse_large(array)
    view = array.view(np.ndarray)
    view.flags.writeable = False
    return view


def in_memory_order(values: Numbers) -> tuple[int, int, int]:
    """Return the axes from the one along which neighbours lie farthest apart in memory to the closest.

    Examples
    --------
    >>> in_memory_order(np.zeros((2, 3, 4))), in_memory_order(np.zeros((2, 3, 4)).T)
    ((0, 1, 2), (2, 1, 0))
    """
    first, second, third = np.argsort([-abs(stride) for stride in values.strides], kind="stable").tolist()
    return first, second, third


def mapped_file(values: Numbers) -> Path | None:
    """Return the file that an array is mapped from without gaps, or None."""
    if not values.transpose(in_memory_order(values)).flags.c_contiguous:
        return None
    owner: object = values
    while isinstance(owner, np.ndarray):
        if isinstance(owner, np.memmap) and owner.filename is not None:
            return Path(owner.filename)
        owner = owner.base
    return None


def _parts(values: Numbers) -> Iterator[Numbers]:
    """Yield all voxels in the order in which they lie in memory or in a file, a few layers at a time."""
    ordered = values.transpose(in_memory_order(values))
    layers = max(1, PART_BYTES // max(1, ordered[0].nbytes))
    for first in range(0, len(ordered), layers):
        yield ordered[first : first + layers]


def _least_and_greatest(values: Numbers) -> tuple[float, float]:
    """Return the least and the greatest value, in one pass; both NaN if any is."""
    with np.errstate(invalid="ignore"):
        low, high = zip(*((part.min(), part.max()) for part in _parts(values)), strict=True)
        return float(np.min(low)), float(np.max(high))


def _finite_values(array: Numbers, nan: str | float) -> Numbers:
    if np.isfinite(_least_and_greatest(array)).all():
        return array
    if nan == "refuse":
        where, count = _not_finite(array)
        message = f"volume.values must be finite, got {array[where]} at (z, y, x) = {where} "
        message += f"and {count} such voxels; "
        raise SceneError(message + "pass nan=VALUE to replace them")
    with np.errstate(over="ignore"):
        value = array.dtype.type(number("volume.nan", nan))
    if not np.isfinite(value):
        message = (
            f"volume.nan must be a finite {array.dtype}, got {nan:g}; choose a value that the type holds"
        )
        raise SceneError(message)
    filled = array.copy(order="K")
    for part in _parts(filled):
        part[~np.isfinite(part)] = value
    return filled


def _not_finite(array: Numbers) -> tuple[tuple[int, ...], int]:
    """Return where (z, y, x) the first voxel in memory lies that is not finite, and how many there are."""
    first, before, count = -1, 0, 0
    for part in _parts(array):
        found = np.flatnonzero(~np.isfinite(part))
        if count == 0 and len(found):
            first = before + int(found[0])
        before, count = before + part.size, count + len(found)
    axes = in_memory_order(array)
    place = np.unravel_index(first, tuple(array.shape[axis] for axis in axes))
    return tuple(int(place[axes.index(axis)]) for axis in range(3)), count


def _refuse_large(array: Numbers) -> None:
    if array.dtype.itemsize < 8:
        return
    largest = max(map(abs, _least_and_greatest(array)))
    # The interpolation takes differences: 1e300 keeps them finite.
    limit = LARGEST_EXACT_INTEGER if array.dtype.kind in "iu" else 1e300
    if largest > limit:
        message = f"volume.values must lie within {limit:g} of 0, got {largest:g}; "
        raise SceneError(message + "rescale them")
