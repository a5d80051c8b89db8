"""Where a file says its voxels are: from its matrix to the fields of `Volume`, in the world volref uses.

volref's world is the one of NIfTI: x to the patient's right, y to the front, z to the head ("RAS+"), in the
file's own unit, which is the millimetre in every medical format.  A file in LPS (DICOM, ITK, most NRRD) has
x and y reversed:

    x_ras = -x_lps,   y_ras = -y_lps,   z_ras = z_lps

so its origin and direction change sign there, and no voxel moves.
"""

from typing import Any

import numpy as np

from volref.arrays import Floats

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
