"""Small golden bundles for tests, written once and copied."""

import contextlib
import dataclasses
import hashlib
import json
import shutil
from unittest import mock

import numpy as np

from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.passes import emulate
from volref.golden import writing
from volref.golden.generators import scene_of
from volref.oracle.acceptance import Acceptance
from volref.oracle.faults.fault import Subject

WIDTH, HEIGHT = 10, 8


def tiny(pipeline="x3dom", device="swiftshader", *, jitter=None, frames=1, **scene):
    """Subject of a few pixels."""
    drawn = dataclasses.replace(scene_of("blobs", **scene), width=WIDTH, height=HEIGHT)
    return Subject(drawn, named(pipeline), Device.named(device), jitter, frames)


def written(folder, subject=None, *, derived=False, **options):
    """Write a bundle; its intervals are derived, which takes a while, only where a test is about them."""
    with contextlib.ExitStack() as stack:
        if not derived:
            stack.enter_context(mock.patch.object(writing, "accept", narrow))
        return writing.write_subject(folder, tiny() if subject is None else subject, **options)


def narrow(scene, pipeline, device, jitter, frames):
    """Intervals of one code around what is emulated."""
    drawn = emulate(scene, pipeline, device, jitter, frames)
    lo, hi = np.maximum(drawn.rgba - 1 / 255, 0), drawn.rgba + 1 / 255
    marked = np.zeros(drawn.samples.shape, np.bool_)
    causes = {"number format": np.full(marked.shape, 2 / 255)}
    fields = (
        lo,
        hi,
        drawn.rgba,
        lo,
        hi,
        marked,
        drawn.samples > 0,
        causes,
        "",
        pipeline,
        device,
        frames,
        0.0,
    )
    return Acceptance(*fields)


def copied(bundle, folder):
    """Copy of a bundle that a test may damage."""
    shutil.copytree(bundle, folder)
    return folder


def manifest_of(folder):
    return json.loads((folder / "manifest.json").read_text(encoding="utf-8"))


def put_manifest(folder, document):
    (folder / "manifest.json").write_text(json.dumps(document), encoding="utf-8")


def put_file(folder, path, content):
    """Replace a file of a bundle, in the manifest too: what a liar would do."""
    (folder / path).write_bytes(content)
    document = manifest_of(folder)
    entry = next(entry for entry in document["files"] if entry["path"] == path)
    entry |= {"bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}
    put_manifest(folder, document)


def put_array(folder, path, array, **options):
    place = folder / "array.npy"
    np.save(place, array, **options)
    content = place.read_bytes()
    place.unlink()
    put_file(folder, path, content)


def contents_of(folder):
    """Every file of a folder with what it holds."""
    return {
        file.relative_to(folder).as_posix(): file.read_bytes()
        for file in sorted(folder.rglob("*"))
        if file.is_file()
    }
