"""Goldens that a test-suite keeps: found, held against what they were made of, made by hand."""

import re
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Floats
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.pipeline import Pipeline
from volref.errors import FormatError
from volref.golden.bundle import Bundle
from volref.golden.contents import MANIFEST
from volref.golden.digests import digest_of_files
from volref.golden.reading import load_bundle
from volref.golden.writing import write_subject
from volref.io.guard import one_line
from volref.io.scenes import load_scene, save_scene
from volref.oracle.faults.fault import Subject
from volref.scene.scene import Scene

PLAIN_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9._-]*")


def subject_of(
    scene: Scene | str | Path,
    pipeline: str | Pipeline,
    device: str | Device,
    jitter: ArrayLike | None = None,
    frames: int = 1,
) -> Subject:
    """Return what a golden is to be made of; the scene may be a file, pipeline and device may be names.

    Raises
    ------
    SceneError
        If a name is not known.
    FormatError
        If the file is no scene.
    """
    return Subject(
        load_scene(scene) if isinstance(scene, str | Path) else scene,
        named(pipeline) if isinstance(pipeline, str) else pipeline,
        Device.named(device) if isinstance(device, str) else device,
        None if jitter is None else np.asarray(jitter, np.float64),
        frames,
    )


def golden_folder(goldens: Path, name: str) -> Path:
    """Return the folder of a golden of that name.

    Raises
    ------
    FormatError
        If the name is not one of letters, digits, ".", "_" and "-".

    Examples
    --------
    >>> golden_folder(Path("goldens"), "head-front").as_posix()
    'goldens/head-front'
    """
    if PLAIN_NAME.fullmatch(name):
        return goldens / name
    message = f"the name of a golden must be of letters, digits, '.', '_' and '-', got {one_line(name)!r}; "
    raise FormatError(message + "rename it")


def kept_golden(folder: Path, subject: Subject | None) -> Bundle:
    """Return the golden in a folder, after checking that it is one of `subject` (None: of whatever it is).

    Raises
    ------
    FormatError
        If there is none, it is damaged, or it was made of something else.
    """
    if not (folder / MANIFEST).is_file():
        message = f"{folder} must be a golden bundle, got none; "
        raise FormatError(message + "make it with pytest --volref-update or volref golden make")
    bundle = load_bundle(folder)
    changed = "" if subject is None else difference_of(bundle, subject)
    if changed:
        message = f"{folder} must be a golden of what the test draws, got one of another {changed}; "
        raise FormatError(message + "make it again with pytest --volref-update")
    return bundle


def updated_golden(folder: Path, subject: Subject) -> bool:
    """Make the golden of `subject` where there is none, or one of something else; return whether it did.

    Raises
    ------
    FormatError
        If something else lies in the folder, or it cannot be written.
    """
    there = (folder / MANIFEST).is_file()
    if there and not _outdated(folder, subject):
        return False
    write_subject(folder, subject, overwrite=there)
    return True


def difference_of(bundle: Bundle, subject: Subject) -> str:
    """Return in a word what a golden was made of that is not as in `subject`; "" if nothing is."""
    pairs = {
        "pipeline": (bundle.pipeline, subject.pipeline),
        "device": (bundle.device, subject.device),
        "number of frames": (bundle.subject.frames, subject.frames),
    }
    for word, (kept, asked) in pairs.items():
        if kept != asked:
            return word
    if not _same_offsets(bundle.subject.jitter, subject.jitter):
        return "jitter"
    scene = sorted(file.name for file in bundle.folder.glob("scene.*"))
    return "" if digest_of_files(bundle.folder, scene) == _scene_digest(subject.scene) else "scene"


def _outdated(folder: Path, subject: Subject) -> bool:
    """Tell whether a golden cannot be read, or was made of something else."""
    try:
        return difference_of(load_bundle(folder), subject) != ""
    except FormatError:
        return True


def _same_offsets(kept: Floats | None, asked: Floats | None) -> bool:
    if kept is None or asked is None:
        return kept is asked
    return np.array_equal(kept, asked)


def _scene_digest(scene: Scene) -> str:
    with tempfile.TemporaryDirectory(prefix="volref-") as place:
        save_scene(scene, Path(place) / "scene.json")
        names = sorted(file.name for file in Path(place).glob("scene.*"))
        return digest_of_files(Path(place), names)
