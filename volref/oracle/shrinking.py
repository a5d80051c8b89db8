"""Failing scenes made small: what is left is what the failure needs.

A part is taken out; if the rest still fails, it stays out (Zeller and Hildebrandt, "Simplifying and
isolating failure-inducing input", IEEE Transactions on Software Engineering 28(2), 2002).  Parts are tried
from large to small, in a fixed order, so that equal failures give equal scenes:

    frames, jitter   one frame, the first; no start offsets
    lights, meshes   all of them, then each
    faces            of each mesh: a half, a quarter, ... a triangle
    image            half the pixels along both sides
    volume           along each axis half of it, from either end, then a quarter, ... a layer
    knots            of the table: a half of them, a quarter, ... one
    background       black and transparent
"""

import dataclasses
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import TypeVar

import numpy as np

from volref.arrays import Indices, whole_number
from volref.errors import SceneError
from volref.oracle.faults.fault import Subject
from volref.scene.mesh import Mesh
from volref.scene.scene import Scene
from volref.scene.transfer import TransferFunction
from volref.scene.volume import Volume

MOST_TRIALS = 10**6

Part = TypeVar("Part")


def shrink(
    subject: Subject,
    fails: Callable[[Subject], bool],
    *,
    trials: int = 300,
    progress: Callable[[int, int], None] | None = None,
) -> Subject:
    """Return the smallest subject found that still fails.

    Parameters
    ----------
    subject
        What fails.
    fails
        Draws a subject by the renderer in question, judges the image (`accept`, `check`), and tells whether
        it fails.  One that a program refuses (`SceneError`) does not.
    trials
        How often to ask at most; the smallest one by then is returned.
    progress
        Called with the number of trials and `trials`.

    Raises
    ------
    SceneError
        If the subject does not fail to begin with.
    """
    most = whole_number("trials", trials, low=1, high=MOST_TRIALS)
    asked = 0

    def still_fails(smaller: Subject) -> bool:
        nonlocal asked
        asked += 1
        if progress is not None:
            progress(asked, most)
        try:
            return fails(smaller)
        except SceneError:
            return False

    if not still_fails(subject):
        message = "subject must fail to be shrunk, got one that passes; check its image first"
        raise SceneError(message)
    found, before = subject, None
    while found is not before:
        before = found
        for reductions in REDUCTIONS:
            found = _reduced(found, reductions, still_fails, lambda: asked < most)
    return found


def _reduced(
    subject: Subject,
    reductions: Callable[[Subject], Iterator[Subject]],
    still_fails: Callable[[Subject], bool],
    may_ask: Callable[[], bool],
) -> Subject:
    """Return what is left when no reduction of one kind leaves a failure."""
    progressed = True
    while progressed:
        progressed = False
        for smaller in reductions(subject):
            if not may_ask():
                return subject
            if still_fails(smaller):
                subject, progressed = smaller, True
                break
    return subject


def _fewer_frames(subject: Subject) -> Iterator[Subject]:
    jitter = subject.jitter
    if jitter is not None:
        yield dataclasses.replace(subject, jitter=None, frames=1)
    if subject.frames > 1:
        yield dataclasses.replace(subject, frames=1, jitter=None if jitter is None else jitter[:1])


def _fewer_lights(subject: Subject) -> Iterator[Subject]:
    for lights in _without_parts(subject.scene.lights):
        yield from _with_scene(subject, lights=lights)


def _fewer_meshes(subject: Subject) -> Iterator[Subject]:
    for meshes in _without_parts(subject.scene.meshes):
        yield from _with_scene(subject, meshes=meshes)


def _fewer_faces(subject: Subject) -> Iterator[Subject]:
    meshes = subject.scene.meshes
    for i, mesh in enumerate(meshes):
        for start, end in _cuts(len(mesh.faces)):
            kept = np.r_[0:start, end : len(mesh.faces)]
            yield from _with_scene(subject, meshes=(*meshes[:i], _with_faces(mesh, kept), *meshes[i + 1 :]))


def _smaller_image(subject: Subject) -> Iterator[Subject]:
    scene, jitter = subject.scene, subject.jitter
    width, height = (max(side // 2, 1) for side in (scene.width, scene.height))
    if (width, height) == (scene.width, scene.height):
        return
    offsets = None if jitter is None else jitter[:, :height, :width]
    yield from _with_scene(dataclasses.replace(subject, jitter=offsets), width=width, height=height)


def _smaller_volume(subject: Subject) -> Iterator[Subject]:
    volume = subject.scene.volume
    if not isinstance(volume, Volume):
        return
    for axis in range(3):
        count = volume.size[axis]
        for start, end in _cuts(count):
            if start == 0:
                yield from _cropped(subject, volume, axis, end, count)
            if end == count:
                yield from _cropped(subject, volume, axis, 0, start)


def _fewer_knots(subject: Subject) -> Iterator[Subject]:
    transfer = subject.scene.transfer
    if not isinstance(transfer, TransferFunction):
        return
    for start, end in _cuts(len(transfer.values)):
        kept = np.r_[0:start, end : len(transfer.values)]
        fewer = dataclasses.replace(
            transfer,
            values=transfer.values[kept],
            colors=transfer.colors[kept],
            extinction=None if transfer.extinction is None else transfer.extinction[kept],
            opacity=None if transfer.opacity is None else transfer.opacity[kept],
        )
        yield from _with_scene(subject, transfer=fewer)


def _clear_background(subject: Subject) -> Iterator[Subject]:
    if any(subject.scene.background):
        yield from _with_scene(subject, background=(0.0, 0.0, 0.0, 0.0))


REDUCTIONS = (
    _fewer_frames,
    _fewer_lights,
    _fewer_meshes,
    _smaller_image,
    _smaller_volume,
    _fewer_faces,
    _fewer_knots,
    _clear_background,
)


def _without_parts(parts: tuple[Part, ...]) -> Iterator[tuple[Part, ...]]:
    """Yield nothing, then all but one."""
    if len(parts) > 1:
        yield ()
    for i in range(len(parts)):
        yield (*parts[:i], *parts[i + 1 :])


def _cuts(count: int) -> Iterator[tuple[int, int]]:
    """Yield what to take out of so many parts, as (start, end): halves, quarters, ... single ones."""
    size = count // 2
    while size:
        for start in range(0, count, size):
            yield start, min(start + size, count)
        size //= 2


def _with_scene(subject: Subject, **changes: object) -> Iterator[Subject]:
    """Yield the subject with another scene; nothing where that breaks a rule."""
    replace: Callable[..., Scene] = dataclasses.replace
    with suppress(SceneError):
        yield dataclasses.replace(subject, scene=replace(subject.scene, **changes))


def _cropped(subject: Subject, volume: Volume, axis: int, start: int, end: int) -> Iterator[Subject]:
    """Yield the subject with the layers from `start` to before `end` alone, where they were."""
    kept = [slice(None)] * 3
    kept[2 - axis] = slice(start, end)
    step = volume.direction[:, axis] * volume.spacing[axis]
    x, y, z = (np.array(volume.origin) + start * step).tolist()
    values = np.array(volume.values[tuple(kept)])
    with suppress(SceneError):
        yield from _with_scene(subject, volume=dataclasses.replace(volume, values=values, origin=(x, y, z)))


def _with_faces(mesh: Mesh, kept: Indices) -> Mesh:
    colors = mesh.colors[kept] if mesh.coloring == "face" else mesh.colors
    return dataclasses.replace(mesh, faces=mesh.faces[kept], colors=colors)
