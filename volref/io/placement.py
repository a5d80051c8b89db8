"""Where a file says its voxels are: from its matrix to the fields of `Volume`, in the world volref uses.

volref's world is the one of NIfTI: x to the patient's right, y to the front, z to the head ("RAS+"), in the
file's own unit, which is the millimetre in every medical format.  A file in LPS (DICOM, ITK, most NRRD) has
x and y reversed:

    x_ras = -x_lps,   y_ras = -y_lps,   z_ras = z_lps

so its origin and direction change sign there, and no voxel moves.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from volref.arrays import Floats
from volref.errors import FormatError
from volref.io.guard import one_line, wrapped

# The signs that take a point of the named space to RAS.
SIGNS = {
    "right-anterior-superior": (1, 1, 1),
    "ras": (1, 1, 1),
    "left-anterior-superior": (-1, 1, 1),
    "las": (-1, 1, 1),
    "left-posterior-superior": (-1, -1, 1),
    "lps": (-1, -1, 1),
    "scanner-xyz": (1, 1, 1),
    "3d-right-handed": (1, 1, 1),
}

GEOMETRY = ("spacing", "origin", "direction", "centering")


def placement_of_affine(affine: Floats, signs: tuple[int, int, int] = (1, 1, 1)) -> dict[str, Any]:
    """Return spacing, origin and direction of a 4x4 matrix from index space to a world with the given signs.

    The spacing is the length of each column, the direction the column divided by it.  A column of length 0
    is passed on, and `Volume` refuses it.

    Examples
    --------
    >>> lps = np.array([[0.0, 2, 0, 10], [1, 0, 0, 20], [0, 0, 3, 30], [0, 0, 0, 1]])
    >>> placed = placement_of_affine(lps, SIGNS["lps"])
    >>> placed["spacing"], placed["origin"], placed["direction"]
    ([1.0, 2.0, 3.0], [-10.0, -20.0, 30.0], [[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    """
    world = np.asarray(affine, dtype=np.float64)[:3] * np.array(signs, dtype=np.float64)[:, None] + 0.0
    linear = world[:, :3]
    spacing = np.sqrt((linear**2).sum(axis=0))
    direction = np.divide(linear, spacing, out=linear.copy(), where=spacing > 0)
    return {"spacing": spacing.tolist(), "origin": world[:, 3].tolist(), "direction": direction.tolist()}


def placement_of_attributes(file: Path, attributes: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the attributes of an array say of its place.

    `spacing`, `origin`, `direction` and `centering` are those of `Volume`, x first; `spacing_zyx` and
    `element_size_um` (of ilastik and Fiji) are spacings with z first.

    Raises
    ------
    FormatError
        If they are not numbers, or differ.

    Examples
    --------
    >>> placement_of_attributes(Path("a.h5"), {"element_size_um": [5.0, 1.0, 0.5], "author": "x"})
    {'spacing': [0.5, 1.0, 5.0]}
    """
    places: dict[str, dict[str, Any]] = {}
    with wrapped(file, "place of a volume", "mend its attributes"):
        for name in GEOMETRY:
            if name in attributes:
                found = attributes[name]
                places[name] = {name: found if isinstance(found, str) else np.asarray(found).tolist()}
        for name in ("spacing_zyx", "element_size_um"):
            if name in attributes:
                places[name] = {"spacing": np.ravel(np.asarray(attributes[name]))[::-1].tolist()}
    return joined_places(file, places)


def joined_places(file: Path, places: Mapping[str, dict[str, Any]]) -> dict[str, Any]:
    """Return what several statements say of one place, the last as it is, if they do not differ.

    Raises
    ------
    FormatError
        If they do.
    """
    joined: dict[str, Any] = {}
    for name, said in places.items():
        for key in joined.keys() & said.keys():
            with wrapped(file, "place of a volume", "mend it"):
                first, second = (np.asarray(value, dtype=np.float64) for value in (joined[key], said[key]))
                # 1e-4: a number beside a matrix may be rounded to 5 digits.
                same = first.shape == second.shape and bool(
                    (np.abs(first - second) <= 1e-4 * np.abs(second).max()).all()
                )
            if not same:
                message = f"{file.name} must state its {key} once, got {one_line(str(joined[key]))} and, by "
                message += f"{name}, {one_line(str(said[key]))}; "
                raise FormatError(message + "remove the one that is wrong")
        joined |= said
    return joined
