"""manifest.json: what is in a bundle, and what its numbers mean."""

import json
from collections.abc import Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from volref.arrays import Floats
from volref.emulation.rays.box import box_of
from volref.errors import FormatError
from volref.golden.contents import MANIFEST, check_path
from volref.golden.migrations import migrated
from volref.io.documents import find_problem
from volref.io.guard import Foreign, existing_file, one_line, read_json, spell_bytes
from volref.oracle.faults.fault import Subject

FORMAT, FORMAT_VERSION = "volref-golden", 1

# Two programs' worth of switches, a recipe and a few dozen files have some 40 kB.
LARGEST_MANIFEST = 2**23

CONVENTIONS = {
    "arrays": ".npy, least byte first, C order; images (height, width, channels), volumes (depth, height, "
    "width, channels)",
    "rows": "row 0 of images is the top; readPixels of WebGL gives the bottom row first",
    "textures": "row 0 of textures is at v = 0, slice 0 at w = 0: uploaded without a flip and without "
    "premultiplying",
    "alpha": "colours and alpha as the program leaves them on its canvas; tables have straight alpha",
    "color_space": "numbers of the canvas as they are stored: no curve is applied or undone, linear or sRGB",
    "number_format": "lo and hi are numbers that the canvas can hold: k / 255 for unorm8; raw_lo and raw_hi "
    "come before that rounding",
    "handedness": "right-handed world, x right and y up in view space, the camera looks along -z; "
    "counter-clockwise triangles face the eye",
    "matrices": "rows first, column vectors: clip = clip_from_view view_from_world world_from_texture "
    "texture",
    "clip_z": "-1 is near and 1 far, as in WebGL, unless camera.clip_z says 0..1",
    "pixels": "pixel and texel centres lie at +1/2",
    "centering": "texel i of n has its centre at texture coordinate (i + 1/2) / n; 0 and 1 are the faces of "
    "the box",
    "unit_distance": "the opacities of the table are those of the transfer function's unit_distance in "
    "scene.json, in world units",
}


def image_of(subject: Subject) -> dict[str, Any]:
    """Return the manifest's "image"."""
    output = subject.pipeline.output
    size = {"width": subject.scene.width, "height": subject.scene.height}
    return size | {"format": output.format, "frames": subject.frames}


def camera_of(subject: Subject) -> dict[str, Any]:
    """Return the manifest's "camera"."""
    scene, camera = subject.scene, subject.scene.camera
    given = camera.clip_matrix is not None
    return {
        "view_from_world": _rows(camera.view_from_world),
        "clip_from_view": _rows(camera.clip_from_view(scene.width, scene.height)),
        "clip_z": camera.clip_z,
        "near": None if given else camera.near,
        "far": None if given else camera.far,
    }


def box_document(subject: Subject) -> dict[str, Any]:
    """Return the manifest's "box"."""
    return {"world_from_texture": _rows(box_of(subject.scene).world_from_texture)}


def manifest_text(document: Mapping[str, Any]) -> str:
    """Return a manifest as JSON text; a list of matrices or files has a line for each item."""
    return json.dumps(document, indent=1, allow_nan=False) + "\n"


def read_manifest(folder: Path) -> dict[str, Any]:
    """Return the manifest of a bundle, brought up to this version of the format.

    Raises
    ------
    FormatError
        If there is none, it is of another format or of a version that is not known, a key is unknown or
        missing, or a value is of the wrong kind.
    """
    if not folder.is_dir():
        message = f"{one_line(str(folder))} must be a folder with a {MANIFEST}, got "
        raise FormatError(message + ("a file" if folder.exists() else "nothing") + "; check the path")
    file = existing_file(folder / MANIFEST)
    if file.stat().st_size > LARGEST_MANIFEST:
        message = f"{MANIFEST} must have at most {spell_bytes(LARGEST_MANIFEST)}, got "
        raise FormatError(message + f"{spell_bytes(file.stat().st_size)}; make the bundle again")
    document = migrated(_checked_head(read_json(file)), folder)
    schema = manifest_schema()
    problem = find_problem(document, schema, schema["$defs"], "")
    if problem is not None:
        raise FormatError(f"{MANIFEST}: {problem}")
    return document


def is_bundle(folder: Path) -> bool:
    """Whether a folder has the manifest of a bundle, of any version."""
    try:
        document = read_json(folder / MANIFEST)
    except FormatError:
        return False
    return isinstance(document, dict) and document.get("format") == FORMAT


def named_paths(document: Mapping[str, Any]) -> dict[str, str]:
    """Return the paths that a manifest names beside its list of files, by where it does; all are plain."""
    paths: dict[str, Foreign] = {f"passes[{k}].path": p["path"] for k, p in enumerate(document["passes"])}
    expected, uploads = document["expected"], document["uploads"]
    paths |= {
        f"expected.{key}": path for key, path in expected.items() if key not in ("causes", "bound_kind")
    }
    paths |= {f"expected.causes.{one_line(key)}": path for key, path in expected["causes"].items()}
    named = ("volume", "volume_picture", "table", "table_picture", "jitter")
    paths |= {f"uploads.{key}": uploads[key] for key in named if uploads.get(key) is not None}
    for where, path in paths.items():
        if not isinstance(path, str):
            message = f"{MANIFEST}: {where} must be text, got {one_line(repr(path))}; make the bundle again"
            raise FormatError(message)
        check_path(where, path)
    return paths


@cache
def manifest_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of manifest.json."""
    text = resources.files("volref.golden").joinpath("manifest.schema.json").read_text(encoding="utf-8")
    schema: dict[str, Any] = json.loads(text)
    return schema


def _checked_head(document: Foreign) -> dict[str, Any]:
    got = document.get("format") if isinstance(document, dict) else type(document).__name__
    if got != FORMAT:
        message = (
            f"{MANIFEST}: format must be {FORMAT!r}, got {one_line(repr(got))}; this is no golden bundle"
        )
        raise FormatError(message)
    checked: dict[str, Any] = document
    return checked


def _rows(matrix: Floats) -> list[list[float]]:
    rows: list[list[float]] = matrix.tolist()
    return rows
