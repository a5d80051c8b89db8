"""Transfer functions of VPT: Gaussian bumps over value and gradient magnitude, drawn into an 8-bit canvas.

    [{"position": {"x": 0.5, "y": 0.5}, "size": {"x": 0.2, "y": 0.2},
      "color": {"r": 1, "g": 0, "b": 0, "a": 1}}, ...]

At the texel centre q, each bump in turn writes s = color e^(-r^2) into all four channels, r = |(position - q)
/ size|, and is blended with what is there:

    "source-alpha"     canvas = s s_a + canvas (1 - s_a), alpha too     SRC_ALPHA, ONE_MINUS_SRC_ALPHA
    "premultiplied"    canvas = s + canvas (1 - s_a)                    ONE, ONE_MINUS_SRC_ALPHA (later VPT)

Every result is held to 0..1 and, in 8 bits, rounded.  The order of the bumps matters.  x = 0 is the left edge
of column 0, y = 0 the lower edge of row 0.
"""

from pathlib import Path

import numpy as np

from volref.arrays import Bytes, Floats, float_array, one_of
from volref.errors import FormatError
from volref.io.guard import Foreign

SIZE = 256
BLENDS = ("source-alpha", "premultiplied")
MOST_BUMPS = 1024

_KEYS = {"position": "xy", "size": "xy", "color": "rgba"}


def bumps_of_document(file: Path, document: Foreign) -> Floats:
    """Return bumps (n, 8): position x, y, size x, y, and red, green, blue, alpha.

    Raises
    ------
    FormatError
        If it is no list of bumps.
    """
    if not 1 <= len(document) <= MOST_BUMPS:
        message = f"{file.name} must hold 1 to {MOST_BUMPS} bumps, got {len(document)}; make them fewer"
        raise FormatError(message)
    rows = []
    for i, bump in enumerate(document):
        row = []
        for key, letters in _KEYS.items():
            part = bump.get(key) if isinstance(bump, dict) else None
            if not isinstance(part, dict) or not set(letters) <= set(part):
                message = (
                    f"{file.name}[{i}] must have {key} with {', '.join(letters)}, got none; save it again"
                )
                raise FormatError(message)
            row += [part[letter] for letter in letters]
        rows.append(row)
    bumps = float_array("bumps", rows, ("n", 8))
    if (bumps[:, 2:4] == 0).any():
        i = int(np.argmax((bumps[:, 2:4] == 0).any(axis=1)))
        message = f"{file.name}[{i}]: size must not be 0, got {bumps[i, 2:4].tolist()}; make it wider"
        raise FormatError(message)
    return bumps


def drawn_bumps(bumps: Floats, *, rounded: bool, blend: str = "source-alpha") -> Floats | Bytes:
    """Return the canvas (256, 256, 4), rows by y upwards: as its 8-bit codes, or unrounded in 0..1.

    Examples
    --------
    >>> flat = np.array([[0.5, 0.5, 1e6, 1e6, 1.0, 0.5, 0.0, 0.4]])
    >>> drawn_bumps(flat, rounded=False)[0, 0].round(6).tolist()
    [0.4, 0.2, 0.0, 0.16]
    >>> drawn_bumps(flat, rounded=True)[0, 0].tolist()
    [102, 51, 0, 41]
    """
    one_of("blend", blend, BLENDS)
    center = (np.arange(SIZE) + 0.5) / SIZE
    canvas = np.zeros((SIZE, SIZE, 4))
    for x, y, width, height, *color in bumps.tolist():
        # Far from a narrow bump the square overflows, and its exponential is 0 all the same.
        with np.errstate(over="ignore", under="ignore"):
            r2 = ((center - x) / width) ** 2 + (((center - y) / height) ** 2)[:, None]
            source = np.clip(np.multiply.outer(np.exp(-r2), color), 0.0, 1.0)
        alpha = source[..., 3:]
        canvas = np.clip(
            source * (alpha if blend == "source-alpha" else 1.0) + canvas * (1 - alpha), 0.0, 1.0
        )
        if rounded:
            canvas = np.rint(canvas * 255) / 255
    return np.rint(canvas * 255).astype(np.uint8) if rounded else canvas
