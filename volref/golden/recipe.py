"""Recipes: what a golden bundle is made of, in some lines of JSON.

A repository keeps recipes and digests; the megabytes are made of them.  Files that a recipe names lie in its
folder, and have the digest that it states.
"""

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from volref.arrays import Floats
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.files.documents import load_device, load_pipeline
from volref.emulation.pipeline import Pipeline
from volref.errors import FormatError
from volref.golden.contents import check_name
from volref.golden.digests import digest_of_file, digest_of_parts
from volref.golden.generators import scene_of
from volref.io.documents import check_format, find_problem
from volref.io.guard import Foreign, path_inside, read_json
from volref.io.jitter import load_jitter
from volref.io.scenes import load_scene
from volref.oracle.faults.fault import Subject
from volref.scene.scene import Scene
from volref.stages.jitter import jitter_images

FORMAT, FORMAT_VERSION = "volref-recipe", 1


@dataclass(frozen=True)
class Recipe:
    """What a bundle is made of: the checked document, and the folder where the files lie that it names."""

    document: Mapping[str, Any]
    folder: Path

    @property
    def name(self) -> str:
        """Short name."""
        return str(self.document["name"])

    @property
    def title(self) -> str:
        """What it shows, in a line."""
        return str(self.document.get("title", ""))

    @property
    def truth(self) -> float | None:
        """Tolerance of the integral that comes along."""
        tolerance = self.document.get("truth")
        return None if tolerance is None else float(tolerance)


def load_recipe(path: str | Path) -> Recipe:
    """Return the recipe in a JSON file.

    Raises
    ------
    FormatError
        If there is none, or it breaks the schema.
    """
    return recipe_of(read_json(Path(path)), Path(path))


def recipe_of(document: Foreign, file: Path) -> Recipe:
    """Return the recipe of plain data from a file; paths are relative to the file's folder.

    Raises
    ------
    FormatError
        If it breaks the schema.

    Examples
    --------
    >>> head = {"format": "volref-recipe", "format_version": 1, "name": "one"}
    >>> parts = {"scene": {"specimen": "blobs"}, "pipeline": {"name": "x3dom"}}
    >>> subject_of(recipe_of(head | parts, Path("one.json"))).pipeline.name
    'x3dom'
    """
    check_format(file, document, FORMAT)
    schema = recipe_schema()
    problem = find_problem(document, schema, schema["$defs"], "")
    if problem is not None:
        raise FormatError(f"{file.name}: {problem}")
    check_name(file, document["name"])
    return Recipe(document, file.parent)


def subject_of(recipe: Recipe) -> Subject:
    """Return what a recipe draws.

    Raises
    ------
    FormatError
        If a file that it names cannot be read, or holds something else than stated.
    SceneError
        If a name is not known, or the scene breaks a rule.
    """
    document = recipe.document
    scene = _scene(recipe, document["scene"])
    size = {key: document[key] for key in ("width", "height") if key in document}
    scene = dataclasses.replace(scene, **size) if size else scene
    frames = int(document.get("frames", 1))
    pipeline = _pipeline(recipe, document["pipeline"])
    device = _device(recipe, document.get("device", {"name": "ideal"}))
    return Subject(scene, pipeline, device, _jitter(recipe, scene, frames), frames)


def digest_of_scene(file: Path) -> str:
    """Return the digest of a scene file and of the files that it names."""
    document = read_json(file)
    parts = {path: digest_of_file(path_inside(file, path)) for path in paths_in(document)}
    return digest_of_parts(parts | {"": digest_of_file(file)})


def paths_in(document: Foreign) -> list[str]:
    """Return every file that a scene's document names.

    Examples
    --------
    >>> paths_in({"volume": {"path": "a.npy"}, "meshes": [{"path": "b.npz"}]})
    ['a.npy', 'b.npz']
    """
    if isinstance(document, list):
        return [path for item in document for path in paths_in(item)]
    if not isinstance(document, dict):
        return []
    here = [value for key, value in document.items() if key == "path" and isinstance(value, str)]
    return here + [path for value in document.values() for path in paths_in(value)]


@cache
def recipe_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of recipes."""
    text = resources.files("volref.golden").joinpath("recipe.schema.json").read_text(encoding="utf-8")
    schema: dict[str, Any] = json.loads(text)
    return schema


def _scene(recipe: Recipe, source: Mapping[str, Any]) -> Scene:
    if "path" not in source:
        return scene_of(**source)
    file = path_inside(recipe.folder / "recipe", source["path"])
    _check_digest(source, digest_of_scene(file))
    return load_scene(file)


def _pipeline(recipe: Recipe, source: Mapping[str, Any]) -> Pipeline:
    if "path" in source:
        return load_pipeline(_file(recipe, source))
    pipeline = named(source["name"])
    return pipeline.with_switches(None, **source["switches"]) if "switches" in source else pipeline


def _device(recipe: Recipe, source: Mapping[str, Any]) -> Device:
    return load_device(_file(recipe, source)) if "path" in source else Device.named(source["name"])


def _jitter(recipe: Recipe, scene: Scene, frames: int) -> Floats | None:
    source = recipe.document.get("jitter")
    if source is None:
        return None
    if "path" in source:
        return load_jitter(_file(recipe, source))
    size = frames, scene.height, scene.width
    if source.get("steady", False):
        return np.array(np.broadcast_to(jitter_images(1, 1, frames, source["seed"]), size))
    return jitter_images(scene.width, scene.height, frames, source["seed"])


def _file(recipe: Recipe, source: Mapping[str, Any]) -> Path:
    """Return a file that a recipe names, after checking that it holds what the recipe was made with."""
    file = path_inside(recipe.folder / "recipe", source["path"])
    _check_digest(source, digest_of_file(file))
    return file


def _check_digest(source: Mapping[str, Any], got: str) -> None:
    if got == source["sha256"]:
        return
    message = f"{source['path']} must hold what the recipe was made with, SHA-256 {source['sha256'][:12]}, "
    raise FormatError(message + f"got {got[:12]}; fetch it again, or state the new one")
