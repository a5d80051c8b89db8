"""Volume-rendering presets of 3D Slicer: transfer function, gradient opacity and material together.

Up to 5.8 an object of strings, in which the first number of a list counts those that follow:

    {"name": "CT-Bone", "scalarOpacity": "4 0 0 255 1", "colorTransfer": "8 0 0 0 0 255 1 1 1",
     "gradientOpacity": "4 0 1 255 1", "shade": "1", "ambient": "0.1", "diffuse": "0.9", "specular": "0.2",
     "specularPower": "10", "interpolation": "1"}

From 5.9 on (.vp.json):

    {"volumeProperties": [{"components": [{"shade": true, "lighting": {"ambient": 0.1, ...},
      "scalarOpacityUnitDistance": 1, "disableGradientOpacity": false,
      "rgbTransferFunction": {"points": [{"x": 0, "color": [0, 0, 0], "midpoint": 0.5, "sharpness": 0}, ...]},
      "scalarOpacity": {"points": [{"x": 0, "y": 0, ...}, ...]}, "gradientOpacity": {"points": [...]}}]}]}

VTK measures a gradient per average voxel spacing (x, y and z): its magnitudes, divided by that spacing, are
those per world unit.  Its volumes are lit by Phong's model, both sides of a gradient alike.
"""

from pathlib import Path

import numpy as np

from volref.arrays import Floats, float_array, number
from volref.errors import FormatError
from volref.io.guard import Foreign, one_line
from volref.io.vtk_curves import color_curve, joined, opacity_curve
from volref.scene.lights import Material
from volref.scene.transfer import TransferFunction

# The terms of Phong's model, with VTK's defaults.
TERMS = {"ambient": 0.1, "diffuse": 0.7, "specular": 0.2, "specularPower": 10.0}


def preset_of_strings(
    file: Path, entry: Foreign, unit_distance: float | None, mean_spacing: float, units: str
) -> tuple[TransferFunction, Material | None]:
    """Return what an object of strings states; the material is None where it says not to shade."""
    colors = _numbers(file, entry, "colorTransfer", 4)
    opacity = _numbers(file, entry, "scalarOpacity", 2)
    gradient = _numbers(file, entry, "gradientOpacity", 2) if "gradientOpacity" in entry else None
    transfer = _transfer(
        colors, opacity, gradient, 1.0 if unit_distance is None else unit_distance, mean_spacing, units
    )
    return transfer, _material(entry) if str(entry.get("shade", "1")) == "1" else None


def preset_of_properties(
    file: Path, document: Foreign, unit_distance: float | None, mean_spacing: float, units: str
) -> tuple[TransferFunction, Material | None]:
    """Return what the one component of the one volume property in a .vp.json states."""
    component = _only(file, "components", _only(file, "volumeProperties", document))
    stated = component.get("scalarOpacityUnitDistance", 1.0) if unit_distance is None else unit_distance
    colors = _points(file, component, "rgbTransferFunction", 3)
    opacity = _points(file, component, "scalarOpacity", 1)
    gradient = None
    if "gradientOpacity" in component and component.get("disableGradientOpacity") is not True:
        gradient = _points(file, component, "gradientOpacity", 1)
    transfer = _transfer(colors, opacity, gradient, stated, mean_spacing, units)
    lighting = component.get("lighting", {})
    if not isinstance(lighting, dict):
        message = f"{file.name}: lighting must be an object, got {type(lighting).__name__}; save it again"
        raise FormatError(message)
    return transfer, _material(lighting) if component.get("shade") is True else None


def _transfer(
    colors: Floats,
    opacity: Floats,
    gradient: Floats | None,
    unit_distance: float,
    mean_spacing: float,
    units: str,
) -> TransferFunction:
    spacing = number("mean_spacing", mean_spacing, above=0)
    knots, channels = joined(color_curve(colors, "RGB"), opacity_curve(opacity))
    factors = None
    if gradient is not None and (gradient[:, 1] != 1).any():
        curve = opacity_curve(gradient)
        factors = curve.knots / spacing, curve.channels[0]
    return TransferFunction.from_opacity(
        knots, channels[:3].T, channels[3], unit_distance, gradient_opacity=factors, units=units
    )


def _material(terms: Foreign) -> Material:
    ambient, diffuse, specular, power = (
        number(f"preset {name}", terms.get(name, standard)) for name, standard in TERMS.items()
    )
    return Material(
        "phong", ambient=ambient, diffuse=diffuse, specular=specular, shininess=power, two_sided=True
    )


def _numbers(file: Path, entry: Foreign, name: str, columns: int) -> Floats:
    """Return the points in a string, rows of x and what holds there."""
    words = str(entry.get(name, "")).split()
    try:
        numbers = [float(word) for word in words]
    except ValueError as error:
        message = f"{file.name}: {name} must hold numbers, got {one_line(str(error))}; mend that place"
        raise FormatError(message) from error
    count = len(numbers) - 1
    if count < columns or numbers[0] != count or count % columns != 0:
        stated = f"{numbers[0]:g}" if numbers else "nothing"
        message = (
            f"{file.name}: {name} must begin with the count of the numbers after it, {columns} for each "
        )
        raise FormatError(message + f"point, got {stated} before {max(count, 0)}; write it again")
    return float_array(f"preset {name}", numbers[1:], ("n",)).reshape(-1, columns)


def _only(file: Path, name: str, document: Foreign) -> Foreign:
    entries = document.get(name)
    if not isinstance(entries, list) or len(entries) != 1 or not isinstance(entries[0], dict):
        got = f"{len(entries)} entries" if isinstance(entries, list) else type(entries).__name__
        message = f"{file.name}: {name} must be a list of one object, got {got}; save one volume by itself"
        raise FormatError(message)
    return entries[0]


def _points(file: Path, component: Foreign, name: str, channels: int) -> Floats:
    """Return the points of a curve (n, channels + 3): x, what holds there, midpoint and sharpness."""
    curve = component.get(name)
    points = curve.get("points") if isinstance(curve, dict) else None
    if not isinstance(points, list) or not points or not all(isinstance(point, dict) for point in points):
        got = f"{len(points)} points" if isinstance(points, list) else type(points).__name__
        message = f"{file.name}: {name}.points must be a list of objects, got {got}; save it again"
        raise FormatError(message)
    rows = []
    for i, point in enumerate(points):
        value = point.get("color") if channels == 3 else [point.get("y")]
        row = [point.get("x"), *(value if isinstance(value, list) else [value])]
        row += [point.get("midpoint", 0.5), point.get("sharpness", 0.0)]
        rows.append([number(f"preset {name}.points[{i}]", item) for item in row])
        if len(row) != channels + 3:
            message = f"{file.name}: {name}.points[{i}] must have {channels} channels, got {len(row) - 3}; "
            raise FormatError(message + "save it again")
    return np.array(rows, dtype=np.float64)
