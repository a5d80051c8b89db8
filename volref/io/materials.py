"""What the materials and colours in mesh files say: colour, opacity and sides, as arguments of `Mesh`.

An OBJ material's Kd is taken as written, its opacity from d or Tr = 1 - d; glTF's baseColorFactor is rounded
to 8 bits by trimesh.  The alphas of colours and textures are kept, but where a glTF material's alphaMode is
OPAQUE, or not stated, they mean nothing (glTF 2.0, 3.9.4).  The back of a glTF material shows only if it is
doubleSided.
"""

from pathlib import Path
from typing import Any

import numpy as np

from volref.arrays import Floats, Numbers
from volref.errors import FormatError
from volref.io.guard import Foreign, one_line

# How many numbers a line of an MTL file has (Wavefront; "Kd r" for r, r, r is not read by trimesh).
MTL_COUNTS = {"kd": 3, "ka": 3, "ks": 3, "ns": 1}
# Opacities of one material that differ by less say the same, rounded.
SAME_OPACITY = 1e-3


def problems_of_mtl(name: str, data: bytes) -> list[str]:
    """Return a sentence for each line for which trimesh would drop a colour, or all materials of the file."""
    problems = []
    for line in data.decode("utf-8", "replace").splitlines():
        key, *words = line.split() or [""]
        count = MTL_COUNTS.get(key.lower())
        if count is not None and (len(words) != count or None in map(_number_in, words)):
            message = f"{one_line(name)} must have {count} number{'s' * (count > 1)} for {key}, got "
            problems.append(message + f"{one_line(line.strip())!r}; mend it")
    return problems


def appearance(file: Path, visual: Foreign) -> dict[str, Any]:
    """Return the arguments of `Mesh` that say how a mesh of trimesh's looks."""
    kind = visual.kind if visual.defined else None
    if kind in ("vertex", "face"):
        codes = np.asarray(visual.vertex_colors if kind == "vertex" else visual.face_colors)
        return {"colors": _colors(codes), "coloring": kind}
    if kind != "texture":
        return {}
    material = visual.material
    image = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
    style = _opacity(file, material) | _sides(material)
    if _is_made_up(material):
        return style
    tint = _tint(file, material)
    texture = None if image is None else _colors(np.asarray(image.convert("RGBA")))
    if not _alphas_count(file, material, tint, texture):
        tint, texture = (None if given is None else given[..., :3] for given in (tint, texture))
    if texture is None:
        return style if tint is None else {**style, "colors": tint}
    if visual.uv is None:
        message = f"{file.name} must have texture coordinates for its texture, got none; export them"
        raise FormatError(message)
    if tint is not None and (tint[:3] != 1).any():
        message = f"{file.name} must not tint its texture, got the factor {tint.tolist()}; "
        raise FormatError(message + "set it (Kd, baseColorFactor) to 1 or multiply it into the texture")
    if tint is not None and len(tint) == 4:
        style["opacity"] = _positive(file, float(tint[3]), "baseColorFactor")
    return {**style, "uv": np.asarray(visual.uv, dtype=np.float64), "texture": texture}


def _colors(codes: Numbers) -> Floats:
    """Return colours in 0..1 of 8-bit RGBA codes (..., 4), without the alphas if all are 255."""
    return np.asarray((codes if (codes[..., 3] < 255).any() else codes[..., :3]) / 255.0)


def _tint(file: Path, material: Foreign) -> Floats | None:
    """Return the colour (3,) or (4,) that a material states, None if it states none."""
    factor = getattr(material, "baseColorFactor", None)
    if factor is not None:
        return _colors(np.asarray(factor))
    # Not `material.diffuse`: trimesh fills in a grey there where an OBJ material has no Kd.
    stated = getattr(material, "kwargs", {}).get("kd")
    if stated is None:
        return None
    color = np.asarray(stated, dtype=np.float64)
    if ((color >= 0) & (color <= 1)).all():
        return color
    message = f"{file.name} must have a Kd of 3 numbers in 0..1, got {color.tolist()}; mend its .mtl file"
    raise FormatError(message)


def _alphas_count(file: Path, material: Foreign, tint: Floats | None, texture: Floats | None) -> bool:
    """Say whether the alphas of a material mean something: in a glTF if its alphaMode is BLEND."""
    if not hasattr(material, "alphaMode"):
        return True
    if material.alphaMode == "MASK" and any(
        each is not None and each.shape[-1] == 4 for each in (tint, texture)
    ):
        message = f"{file.name} must have no cut-outs, got a material with alphaMode MASK; "
        raise FormatError(message + "set it to BLEND, or to OPAQUE")
    return bool(material.alphaMode == "BLEND")


def _sides(material: Foreign) -> dict[str, Any]:
    """Return the sides that a glTF material shows; others show both."""
    if not hasattr(material, "doubleSided"):
        return {}
    return {"sides": "both" if material.doubleSided else "front"}


def _opacity(file: Path, material: Foreign) -> dict[str, Any]:
    """Return the opacity of an OBJ material, which trimesh does not read: d, or Tr = 1 - d."""
    stated: dict[str, list[str]] = getattr(material, "kwargs", {})
    if "map_d" in stated:
        message = f"{file.name} must have one opacity per material, got map_d "
        message += f"{one_line(' '.join(stated['map_d']))}; "
        raise FormatError(message + "put it into the alpha of the texture, and remove map_d")
    found: dict[str, float] = {}
    for key, spelling in (("d", "d"), ("tr", "Tr")):
        if key in stated:
            words = stated[key]
            # "d -halo 0.5" is thinner the more obliquely it is seen; of "d -halo 1" nothing comes.
            value = _number_in(words[-1])
            if value is None or not 0 <= value <= 1 or (len(words) > 1 and value != 1):
                message = f"{file.name} must have {spelling} as one number in 0..1, got {spelling} "
                raise FormatError(message + f"{one_line(' '.join(words))}; mend its .mtl file")
            found[spelling] = value if key == "d" else 1 - value
    if not found:
        return {}
    if max(found.values()) - min(found.values()) > SAME_OPACITY:
        message = f"{file.name} must have d = 1 - Tr, got d {found['d']:g} and Tr {1 - found['Tr']:g}; "
        raise FormatError(message + "remove one of them")
    spelling, opacity = next(iter(found.items()))
    return {"opacity": _positive(file, opacity, spelling)}


def _positive(file: Path, opacity: float, spelling: str) -> float:
    if opacity > 0:
        return opacity
    message = f"{file.name} must show its mesh, got an opacity of 0 by {spelling}; "
    raise FormatError(message + "remove the mesh, or make it opaque")


def _number_in(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _is_made_up(material: Foreign) -> bool:
    """Say whether trimesh made the material up, for texture coordinates without one: it is a 2 x 2 image."""
    from trimesh.visual.material import empty_material

    usual = empty_material()
    image = getattr(material, "image", None)
    return image is not None and image.size == usual.image.size and hash(material) == hash(usual)
