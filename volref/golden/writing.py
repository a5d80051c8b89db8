"""`write_bundle`: a golden bundle on the disk, whole or not at all."""

import dataclasses
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Numbers
from volref.emulation.catalogue import named
from volref.emulation.device import FORMAT as DEVICE_FORMAT
from volref.emulation.device import FORMAT_VERSION as DEVICE_FORMAT_VERSION
from volref.emulation.device import Device
from volref.emulation.passes import emulate
from volref.emulation.pipeline import Pipeline
from volref.emulation.result import Emulation
from volref.errors import FormatError
from volref.golden.contents import MANIFEST, listed_files
from volref.golden.digests import digest_of_document, digest_of_files
from volref.golden.environment import environment
from volref.golden.inputs import plain, write_array, write_inputs
from volref.golden.manifest import (
    CONVENTIONS,
    FORMAT,
    FORMAT_VERSION,
    box_document,
    camera_of,
    image_of,
    is_bundle,
    manifest_text,
)
from volref.io.atomic import write_text
from volref.io.folders import atomic_folder
from volref.io.guard import one_line
from volref.io.png import write_png
from volref.io.scenes import save_scene
from volref.oracle.acceptance import Acceptance
from volref.oracle.accepting import accept
from volref.oracle.faults.fault import Subject
from volref.scene.scene import Scene
from volref.scene.volume import Volume
from volref.truth.rendering import render


class Options(TypedDict, total=False):
    """What may be said beside the subject of a bundle; see `write_bundle`."""

    name: str | None
    title: str
    recipe: Mapping[str, Any] | None
    truth: float | None
    overwrite: bool


def write_bundle(
    folder: str | Path,
    scene: Scene,
    pipeline: str | Pipeline,
    device: str | Device | None = None,
    jitter: ArrayLike | None = None,
    frames: int = 1,
    **options: Unpack[Options],
) -> Path:
    """Draw a scene, work out what a correct machine may draw of it, and write it all as a golden bundle.

    Returns its folder.

    Parameters
    ----------
    folder
        The bundle's folder.  It appears when all of it is written.
    scene, pipeline, device, jitter, frames
        As `accept` takes them.
    options
        `name`, a short name, that of the folder by default; `title`, a line for people; `truth`, a
        tolerance: the integral itself comes along, with a proven bound on its error; `overwrite`, whether a
        bundle that is there is replaced (nothing else ever is); `recipe`, what the bundle was made of.

    Raises
    ------
    FormatError
        If the folder exists, or cannot be written.
    SceneError
        If the program cannot draw the scene.
    """
    program = named(pipeline) if isinstance(pipeline, str) else pipeline
    machine = Device.named(device) if isinstance(device, str) else Device() if device is None else device
    offsets = None if jitter is None else np.asarray(jitter, np.float64)
    return write_subject(folder, Subject(scene, program, machine, offsets, frames), **options)


def write_subject(folder: str | Path, subject: Subject, **options: Unpack[Options]) -> Path:
    """Write the golden bundle of a subject; see `write_bundle`."""
    target = Path(folder)
    overwrite = options.get("overwrite", False)
    with atomic_folder(target, overwrite=overwrite, replaceable=is_bundle) as part:
        parts = write_parts(part, subject, truth=options.get("truth"))
        recipe = options.get("recipe")
        document = {
            "format": FORMAT,
            "format_version": FORMAT_VERSION,
            "volref": _version(),
            "name": options.get("name") or target.name,
            "title": options.get("title", ""),
            "conventions": CONVENTIONS,
            "image": image_of(subject),
            "camera": camera_of(subject),
            "box": box_document(subject),
            "pipeline": subject.pipeline.as_dict(),
            "device": device_document(subject.device),
            "jitter": _jitter_kind(subject),
            **parts,
            "recipe": None if recipe is None else dict(recipe),
            "environment": environment(),
        }
        document |= {"recipe_sha256": digest_of_subject(part, document), "files": listed_files(part)}
        write_text(part / MANIFEST, manifest_text(document))
    return target


def digest_of_subject(folder: Path, document: Mapping[str, Any]) -> str:
    """Return the digest of what the images of a bundle follow from."""
    scene = sorted(file.name for file in folder.glob("scene.*"))
    keys = ("pipeline", "device", "jitter")
    causes: dict[str, Any] = {key: document[key] for key in keys}
    causes |= {"scene": digest_of_files(folder, scene), "frames": document["image"]["frames"]}
    jitter = document["uploads"]["jitter"]
    return digest_of_document(causes | {"offsets": jitter and digest_of_files(folder, [jitter])})


def device_document(device: Device) -> dict[str, Any]:
    """Return a device as plain data, every switch spelt out."""
    return {"format": DEVICE_FORMAT, "version": DEVICE_FORMAT_VERSION, **device.as_dict()}


def write_parts(
    part: Path, subject: Subject, *, truth: float | None = None, interval: bool = True
) -> dict[str, Any]:
    """Write all but the manifest; return what that says of it.  Without `interval` only what is drawn."""
    save_scene(_plain_scene(subject.scene), part / "scene.json")
    asked = subject.scene, subject.pipeline, subject.device, subject.jitter, subject.frames
    drawn = emulate(*asked)
    document: dict[str, Any] = {
        "uploads": write_inputs(part, subject),
        "passes": _write_passes(part, drawn),
        "expected": _write_drawn(part, drawn),
    }
    if interval:
        accepted = accept(*asked)
        document["expected"] |= _write_accepted(part, accepted)
        document["acceptance"] = {
            "advice": accepted.advice,
            "width_p50": accepted.percentile(50),
            "width_p99": accepted.percentile(99),
            "share_ambiguous": accepted.share_ambiguous,
        }
    document["expected"] |= _write_truth(part, subject.scene, truth)
    return document


def _write_passes(part: Path, drawn: Emulation) -> list[dict[str, str]]:
    """Write every target of an emulation to `passes/` of a folder; return the manifest's "passes"."""
    (part / "passes").mkdir()
    return [
        {"name": name, "path": write_array(part, f"passes/{number:02d}_{_file_stem(name)}.npy", target)}
        for number, (name, target) in enumerate(drawn.passes.items(), start=1)
    ]


def _write_drawn(part: Path, drawn: Emulation) -> dict[str, Any]:
    (part / "expected").mkdir()
    arrays = {"nominal": drawn.rgba.astype(np.float64)}
    if np.isfinite(drawn.distance).any():
        arrays["distance"] = drawn.distance.astype(np.float64)
    preview = "expected/preview.png"
    write_png(part / preview, drawn.rgba8)
    return _write_arrays(part, arrays) | {"preview": preview}


def _write_accepted(part: Path, accepted: Acceptance) -> dict[str, Any]:
    arrays: dict[str, Numbers] = {key: getattr(accepted, key) for key in ("lo", "hi", "raw_lo", "raw_hi")}
    arrays |= {"ambiguous": accepted.ambiguous, "drawn": accepted.drawn}
    if accepted.low_quality is not None:
        coarse = accepted.low_quality()
        arrays |= {"low_quality_lo": coarse.lo, "low_quality_hi": coarse.hi}
    causes = {f"cause_{number}": width for number, width in enumerate(accepted.causes.values())}
    written = _write_arrays(part, causes)
    named = {name: written[f"cause_{number}"] for number, name in enumerate(accepted.causes)}
    return _write_arrays(part, arrays) | {"causes": named}


def _write_arrays(part: Path, arrays: Mapping[str, Numbers]) -> dict[str, Any]:
    return {key: write_array(part, f"expected/{key}.npy", array) for key, array in arrays.items()}


def _write_truth(part: Path, scene: Scene, tolerance: float | None) -> dict[str, Any]:
    if tolerance is None:
        return {}
    out = render(scene, tolerance=tolerance)
    written = _write_arrays(part, {"truth": out.rgba, "bound": out.bound})
    return written | {"bound_kind": out.bound_kind}


def _plain_scene(scene: Scene) -> Scene:
    """Return a scene whose volume is written in C order, least byte first."""
    volume = scene.volume
    if not isinstance(volume, Volume):
        return scene
    return dataclasses.replace(scene, volume=dataclasses.replace(volume, values=plain(volume.values)))


def _jitter_kind(subject: Subject) -> str:
    if not subject.pipeline.stepping.jitter:
        return "none"
    return "free" if subject.jitter is None else "given"


def _file_stem(name: str) -> str:
    stem = re.sub(r"[^A-Za-z0-9_-]", "_", name)
    if stem:
        return stem
    message = f"the name of a pass must have letters, got {one_line(name)!r}; name the target"
    raise FormatError(message)


def _version() -> str:
    from volref import __version__

    return __version__
