"""`load_bundle`: a golden bundle from a stranger's hands, checked before any of it is used."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from volref.arrays import Numbers
from volref.emulation.files.documents import device_from_dict
from volref.emulation.pipeline import Pipeline
from volref.errors import FormatError, SceneError
from volref.golden.bundle import Bundle
from volref.golden.contents import MANIFEST, check_listed, checked_files
from volref.golden.manifest import named_paths, read_manifest
from volref.golden.recipe import paths_in
from volref.io.guard import DEFAULT_MAX_BYTES, Foreign, one_line, read_json
from volref.io.npy import read_npy
from volref.io.scenes import load_scene
from volref.oracle.acceptance import Acceptance
from volref.oracle.faults.fault import Subject
from volref.scene.scene import Scene

IMAGES = ("nominal", "lo", "hi", "raw_lo", "raw_hi")
MASKS = ("ambiguous", "drawn")

# What `save_scene` writes beside a scene.
SCENE_FILES = (".npy", ".npz", ".json")


def load_bundle(folder: str | Path, *, max_bytes: int = DEFAULT_MAX_BYTES) -> Bundle:
    """Return the golden bundle in a folder.

    Size and SHA-256 of every file are held against the manifest before anything in it is used.  Files that
    the manifest does not list are not looked at.

    Raises
    ------
    FormatError
        If there is none, it is of a format that is not known, a file is missing, damaged or outside the
        folder, arrays are not of the image's shape, or all would take more than `max_bytes`.
    """
    place = Path(folder)
    document = read_manifest(place)
    named = named_paths(document)
    files = checked_files(place, document["files"], max_bytes)
    check_listed([*named.values(), "scene.json"], files)
    arrays = _Arrays(files, document, max_bytes)
    try:
        return _built(place, document, arrays)
    except SceneError as error:
        message = f"{one_line(place.name)}: {error}"
        raise FormatError(message) from error


@dataclass(frozen=True)
class _Arrays:
    """The arrays of a bundle whose files were checked."""

    files: Mapping[str, Path]
    manifest: Mapping[str, Any]
    max_bytes: int

    def read(self, path: str) -> Numbers:
        """Return an array whose numbers are all there in memory."""
        array = np.array(read_npy(self.files[path], self.max_bytes))
        if array.dtype.kind in "biuf":
            return array
        message = f"{path} must hold numbers, got {array.dtype}; make the bundle again"
        raise FormatError(message)

    def image(self, path: str, kind: str, channels: tuple[int, ...]) -> Foreign:
        """Return an array of the image's size and of one type."""
        image = self.manifest["image"]
        wanted = (image["height"], image["width"], *channels)
        array = self.read(path)
        if array.shape != wanted or array.dtype != np.dtype(kind):
            message = f"{path} must hold {np.dtype(kind)} of shape {wanted}, got {array.dtype} of shape "
            raise FormatError(message + f"{array.shape}; make the bundle again")
        if np.isnan(array).any():
            message = f"{path} must hold numbers, got NaN; make the bundle again"
            raise FormatError(message)
        array.flags.writeable = False
        return array


def _built(place: Path, document: dict[str, Any], arrays: _Arrays) -> Bundle:
    expected, frames = document["expected"], document["image"]["frames"]
    scene = _scene(place, document, arrays)
    pipeline, device = Pipeline.from_dict(document["pipeline"]), device_from_dict(document["device"])
    jitter = document["uploads"]["jitter"]
    offsets = None if jitter is None else np.asarray(arrays.read(jitter), np.float64)
    images = {key: arrays.image(expected[key], "f8", (4,)) for key in IMAGES}
    masks = {key: arrays.image(expected[key], "?", ()) for key in MASKS}
    causes = {name: arrays.image(path, "f8", ()) for name, path in expected["causes"].items()}
    _check_order(expected, images)
    accepted = Acceptance(
        **images,
        **masks,
        causes=causes,
        advice=document["acceptance"]["advice"],
        pipeline=pipeline,
        device=device,
        frames=frames,
        seconds=0.0,
    )
    if "low_quality_lo" in expected and "low_quality_hi" in expected:
        ends = {key: arrays.image(expected[f"low_quality_{key}"], "f8", (4,)) for key in ("lo", "hi")}
        coarse = replace(accepted, **ends, raw_lo=ends["lo"], raw_hi=ends["hi"])
        accepted = replace(accepted, low_quality=lambda: coarse)
    more: dict[str, Any] = {
        key: arrays.image(expected[key], "f8", channels)
        for key, channels in (("distance", ()), ("truth", (4,)), ("bound", ()))
        if key in expected
    }
    passes = {entry["name"]: arrays.read(entry["path"]) for entry in document["passes"]}
    subject = Subject(scene, pipeline, device, offsets, frames)
    return Bundle(place, document, subject, accepted, passes, **more)


def _scene(place: Path, document: dict[str, Any], arrays: _Arrays) -> Scene:
    """Return the scene, all of whose files are listed and of formats that name no others."""
    named = paths_in(read_json(place / "scene.json"))
    beside = [f"{path}.json" for path in named if (place / f"{path}.json").exists()]
    check_listed([*named, *beside], arrays.files)
    for path in named:
        if Path(path).suffix not in SCENE_FILES:
            message = f"scene.json must name {', '.join(SCENE_FILES)} files in a bundle, got {path!r}; "
            raise FormatError(message + "make the bundle again")
    scene = load_scene(place / "scene.json", max_bytes=arrays.max_bytes)
    image = document["image"]
    if (scene.width, scene.height) == (image["width"], image["height"]):
        return scene
    message = f"{MANIFEST}: image must have the size of the scene, {scene.width} x {scene.height}, got "
    raise FormatError(message + f"{image['width']} x {image['height']}; make the bundle again")


def _check_order(expected: Mapping[str, Any], images: Mapping[str, Numbers]) -> None:
    for low, high in (("lo", "hi"), ("raw_lo", "raw_hi")):
        if (images[low] > images[high]).any():
            message = f"{expected[low]} must not exceed {expected[high]}, got one that does; "
            raise FormatError(message + "make the bundle again")
