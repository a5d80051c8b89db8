"""Faults of colour spaces and blending: rows C and B of the table."""

import dataclasses

import numpy as np

from volref.arrays import Floats
from volref.emulation.targets.canvas import store
from volref.image import decode_srgb, encode_srgb
from volref.oracle.faults.fault import Subject
from volref.oracle.faults.making import fault, replaced, switched
from volref.oracle.faults.table_texture import entries_of, plain_table, with_entries

# What a program blends with that takes its colours for straight.
TWICE = {"premultiplied": "straight", "shader": "shader-straight", "none": "straight"}


def _on_canvas(colors: Floats, image: Floats, subject: Subject) -> Floats:
    """Return an image (H, W, 4) with other colours (H, W, 3), as its canvas holds them."""
    together = np.concatenate([colors, image[..., 3:]], axis=-1)
    return store(together, subject.pipeline.output.format, subject.device)


def _encoded(image: Floats, subject: Subject, _: float) -> Floats:
    return _on_canvas(encode_srgb(image[..., :3]), image, subject)


def _has_gamma(subject: Subject) -> bool:
    return subject.pipeline.output.gamma != 1.0


def _left_as_light(subject: Subject, _: float) -> Subject:
    return switched(subject, output={"gamma": 1.0})


def _decoded_unless_light(image: Floats, subject: Subject, _: float) -> Floats:
    """Return an image that a program without an encoding of its own has had decoded."""
    if _has_gamma(subject):
        return image
    return _on_canvas(decode_srgb(image[..., :3]), image, subject)


def _blended_as_light(subject: Subject, _: float) -> Subject:
    """Return a subject that blends light where it is code values that belong, or the other way."""
    if _has_gamma(subject):
        return switched(subject, output={"blend": "premultiplied"})
    entries = entries_of(subject)
    entries[:, :3] = decode_srgb(np.clip(entries[:, :3], 0, 1))
    red, green, blue, alpha = subject.scene.background
    straight = np.array([red, green, blue]) / alpha if alpha else np.zeros(3)
    light = decode_srgb(np.clip(straight, 0, 1)) * alpha
    changed = with_entries(subject, entries)
    scene = dataclasses.replace(changed.scene, background=(*light, alpha))
    return dataclasses.replace(changed, scene=scene)


def _encoded_unless_gamma(image: Floats, subject: Subject, strength: float) -> Floats:
    return image if _has_gamma(subject) else _encoded(image, subject, strength)


COLOR = (
    fault("C1-srgb-twice", "colours are encoded once too often", after=_encoded),
    fault(
        "C1-srgb-never",
        "colours are left as light, or decoded once too often",
        _left_as_light,
        after=_decoded_unless_light,
    ),
    fault(
        "C1-wrong-space",
        "colours are blended in the wrong space, light for code values or the other way",
        _blended_as_light,
        where=lambda subject: (
            plain_table(subject) if not _has_gamma(subject) else subject.pipeline.output.blend == "shader"
        ),
        after=_encoded_unless_gamma,
    ),
    fault(
        "B1-blended-twice",
        "the blend state multiplies by alpha what is premultiplied already",
        replaced("output", "blend", TWICE),
    ),
)
