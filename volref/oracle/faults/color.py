"""Faults of colour spaces and blending: rows C and B of the table."""

import math

import numpy as np

from volref.oracle.faults.fault import Subject
from volref.oracle.faults.making import fault, replaced, switched
from volref.oracle.faults.table_texture import entries_of, plain_table, with_entries

# What a program blends with that takes its colours for straight.
TWICE = {"premultiplied": "straight", "shader": "shader-straight", "none": "straight"}

# The power that stands for sRGB's curve where a program has no other.
GAMMA = 2.2


def _bent(subject: Subject, gamma: float) -> Subject:
    """Return a subject that raises its colours to 1 / gamma once more, but not its background's light."""
    now = subject.pipeline.output.gamma
    if now == 1.0:
        return switched(subject, output={"gamma": gamma})
    return switched(subject, output={"encodings": 1.0 + math.log(gamma) / math.log(now)})


def _left_as_light(subject: Subject, _: float) -> Subject:
    """Return a subject without its encoding; one that has none, decoded."""
    if subject.pipeline.output.gamma == 1.0:
        return switched(subject, output={"gamma": 1.0 / GAMMA})
    return switched(subject, output={"encodings": 0.0})


def _blended_as_light(subject: Subject, _: float) -> Subject:
    """Return a subject that blends light where it is code values that belong, or the other way."""
    if subject.pipeline.output.gamma != 1.0:
        return switched(subject, output={"blend": "premultiplied"})
    entries = np.clip(entries_of(subject), 0.0, 1.0)
    if subject.pipeline.table.format == "unorm8":
        entries = np.rint(255 * entries) / 255
    entries[:, :3] **= GAMMA
    # Colours are light after they are read: bytes of light would be coarser.
    return switched(with_entries(subject, entries), table={"format": "float"}, output={"gamma": GAMMA})


def _has_a_space(subject: Subject) -> bool:
    output = subject.pipeline.output
    return plain_table(subject) if output.gamma == 1.0 else output.blend == "shader"


COLOR = (
    fault(
        "C1-srgb-twice",
        "colours are encoded once too often",
        _bent,
        strengths=(GAMMA,),
        fitted=True,
    ),
    fault("C1-srgb-never", "colours are not encoded, or decoded once too often", _left_as_light),
    fault(
        "C1-wrong-space",
        "colours are blended in the wrong space, light for code values or the other way",
        _blended_as_light,
        where=_has_a_space,
    ),
    fault(
        "B1-blended-twice",
        "the blend state multiplies by alpha what is premultiplied already",
        replaced("output", "blend", TWICE),
    ),
)
