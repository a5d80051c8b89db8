"""How faults are made: changes of a subject in few words, and whether a change can be had at all."""

import dataclasses
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Floats, Numbers
from volref.emulation.agreement import check_agreement, check_drawable, check_steps
from volref.emulation.loop.shading import check_gradients
from volref.emulation.surfaces.meshes import check_meshes
from volref.emulation.switches import Plain
from volref.errors import SceneError
from volref.oracle.faults.fault import Fault, Subject, unchanged
from volref.scene.volume import Volume


def fault(
    key: str,
    title: str,
    changed: Callable[[Subject, float], Subject] | None = None,
    *,
    where: Callable[[Subject], bool] = lambda _: True,
    strengths: tuple[float, ...] = (1.0,),
    fitted: bool = False,
    after: Callable[[Floats, Subject, float], Floats] = unchanged,
) -> Fault:
    """Return a fault that suits the subjects `where` says, if it changes them into what can be drawn."""
    change = _same if changed is None else changed

    def suits(subject: Subject) -> bool:
        if not where(subject):
            return False
        return after is not unchanged or any(_changes(subject, change, one) for one in strengths)

    return Fault(key, title, strengths, fitted, suits, change, after)


def strengths_for(one: Fault, subject: Subject) -> tuple[float, ...]:
    """Return the strengths of a fault that change a subject, of those that it lists."""
    if not one.suits(subject):
        return ()
    if one.after is not unchanged:
        return one.strengths
    return tuple(strength for strength in one.strengths if _changes(subject, one.changed, strength))


def check_subject(subject: Subject) -> None:
    """Refuse a subject that cannot be drawn.

    Raises
    ------
    SceneError
        If `emulate` would.
    """
    scene, pipeline = subject.scene, subject.pipeline
    check_drawable(scene, pipeline)
    check_steps(pipeline.stepping)
    check_meshes(scene, pipeline)
    check_gradients(scene, pipeline)
    check_agreement(scene, pipeline)


def _changes(subject: Subject, changed: Callable[[Subject, float], Subject], strength: float) -> bool:
    try:
        other = changed(subject, strength)
        check_subject(other)
    except SceneError:
        return False
    same = other.pipeline == subject.pipeline and other.device == subject.device
    return not same or other.scene is not subject.scene or other.jitter is not subject.jitter


def _same(subject: Subject, _: float) -> Subject:
    return subject


def switched(subject: Subject, **groups: Mapping[str, Plain]) -> Subject:
    """Return a subject with other switches of its program."""
    return dataclasses.replace(subject, pipeline=subject.pipeline.with_switches(None, **groups))


def switching(**groups: Mapping[str, Plain]) -> Callable[[Subject, float], Subject]:
    """Return the change of a fault that is nothing but switches."""
    return lambda subject, _: switched(subject, **groups)


def replaced(
    group: str, switch: str, words: Mapping[str, Plain], *more: tuple[str, Plain]
) -> Callable[[Subject, float], Subject]:
    """Return the change that puts another value in the place of some values of a switch, and leaves others.

    more: other switches of the group that go with it.
    """

    def changed(subject: Subject, _: float) -> Subject:
        now = getattr(getattr(subject.pipeline, group), switch)
        return switched(subject, **{group: {switch: words[now], **dict(more)}}) if now in words else subject

    return changed


def with_volume(subject: Subject, **fields: ArrayLike | str) -> Subject:
    """Return a subject whose volume has other fields."""
    volume = subject.scene.volume
    assert isinstance(volume, Volume)
    now = {name: getattr(volume, name) for name in ("values", "spacing", "origin", "direction", "centering")}
    changed = Volume(**(now | fields))
    return dataclasses.replace(subject, scene=dataclasses.replace(subject.scene, volume=changed))


def in_same_box(subject: Subject, values: Numbers) -> Subject:
    """Return a subject with other voxels, of any number, in the box of its volume."""
    volume = grid_of(subject)
    low, high = volume.index_bounds
    margin = 0.5 if volume.centering == "cell" else 0.0
    cells = np.array(values.shape[::-1]) - 1 + 2 * margin
    spacing = np.array(volume.spacing) * (high - low) / cells
    corner = volume.world_from_index[:3, :3] @ low + np.array(volume.origin)
    origin = corner + volume.direction @ (spacing * margin)
    return with_volume(subject, values=values, spacing=spacing, origin=origin)


def has_grid(subject: Subject) -> bool:
    """Tell whether a subject has voxels rather than a radar."""
    return isinstance(subject.scene.volume, Volume)


def grid_of(subject: Subject) -> Volume:
    """Return the voxels of a subject that has them."""
    assert isinstance(subject.scene.volume, Volume)
    return subject.scene.volume


def has_atlas(subject: Subject) -> bool:
    """Tell whether a subject's volume lies in a texture of tiles."""
    return subject.pipeline.volume.layout == "atlas"


def has_boxed_atlas(subject: Subject) -> bool:
    """Tell whether those tiles are the slices of voxels."""
    return has_atlas(subject) and has_grid(subject)
