"""Colour maps of ParaView and vtk.js: JSON with colours in one of five spaces, and with or without opacities.

    [{"Name": "Cool to Warm", "ColorSpace": "Diverging", "NanColor": [1, 1, 0],
      "RGBPoints": [x, r, g, b, ...], "Points": [x, opacity, midpoint, sharpness, ...]}, ...]

Colours run from one point to the next as in VTK, cut into straight pieces that are within 1e-4 of it.
Without "Points" the opacity runs from 0 to 1, ParaView's own default.  Hues go around the short way only if
the map says "HSVWrap": 1, as in ParaView (in vtk.js always).
"""

from pathlib import Path

import numpy as np

from volref.arrays import Floats, float_array
from volref.errors import FormatError
from volref.io.guard import Foreign, one_line
from volref.io.vtk_curves import LARGEST, SPACES, color_curve, joined, opacity_curve
from volref.scene.transfer import TransferFunction


def transfer_of_map(
    file: Path, entry: Foreign, domain: tuple[float, float] | None, unit_distance: float, units: str
) -> TransferFunction:
    """Return the transfer function of one colour map; `domain` replaces the ends of its values.

    Raises
    ------
    FormatError
        If it is no continuous map in a known space.
    SceneError
        If its numbers break a rule.
    """
    if entry.get("IndexedColors") is not None or "RGBPoints" not in entry:
        got = "IndexedColors" if entry.get("IndexedColors") is not None else "none"
        message = f"{file.name} must have RGBPoints, which are continuous, got {got}; choose another map"
        raise FormatError(message)
    if entry.get("UseLogScale"):
        message = f"{file.name} must be linear in the value, got UseLogScale; turn it off and save it again"
        raise FormatError(message)
    colors = _rows(file, "RGBPoints", entry["RGBPoints"])
    if entry.get("Points") is None:
        opacity = np.array([[colors[:, 0].min(), 0.0, 0.5, 0.0], [colors[:, 0].max(), 1.0, 0.5, 0.0]])
    else:
        opacity = _rows(file, "Points", entry["Points"])
    if domain is not None:
        colors[:, 0], opacity[:, 0] = _spread(colors[:, 0], domain), _spread(opacity[:, 0], domain)
    knots, channels = joined(color_curve(colors, _space_of(file, entry)), opacity_curve(opacity))
    return TransferFunction.from_opacity(knots, channels[:3].T, channels[3], unit_distance, units=units)


def _space_of(file: Path, entry: Foreign) -> str:
    space = entry.get("ColorSpace", "RGB")
    if space not in SPACES:
        known = ", ".join(SPACES[:-1])
        message = f"{file.name}: ColorSpace must be one of {known}, got {one_line(repr(space))}; "
        raise FormatError(message + "save the map in another space")
    return "wrapped HSV" if space == "HSV" and entry.get("HSVWrap") else str(space)


def _rows(file: Path, name: str, numbers: object) -> Floats:
    """Return points as a new array (n, 4)."""
    if not isinstance(numbers, list) or not numbers or len(numbers) % 4 != 0:
        got = f"{len(numbers)} numbers" if isinstance(numbers, list) else type(numbers).__name__
        message = f"{file.name}: {name} must be a list of numbers, four for each point, got {got}; "
        raise FormatError(message + "save it again")
    return float_array(f"transfer {name}", numbers, ("n",), limit=LARGEST).reshape(-1, 4).copy()


def _spread(values: Floats, domain: tuple[float, float]) -> Floats:
    """Return values moved so that the least and the greatest are the ends of the domain."""
    low, high = values.min(), values.max()
    share = (values - low) / (high - low) if high > low else np.zeros(len(values))
    return np.asarray(domain[0] + (domain[1] - domain[0]) * share)
