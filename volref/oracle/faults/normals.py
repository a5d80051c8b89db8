"""Faults of gradients and lights: rows N of the table."""

from volref.emulation.textures.gradient_volume import has_gradient_volume
from volref.oracle.faults.fault import Subject
from volref.oracle.faults.making import fault, replaced, switching


def _lit(subject: Subject) -> bool:
    return subject.pipeline.lighting.model != "none" and subject.scene.lights_volume


def _lit_by_texture(subject: Subject) -> bool:
    return _lit(subject) and has_gradient_volume(subject.pipeline.lighting)


NORMALS = (
    fault(
        "N1-sign",
        "normals have the wrong sign",
        replaced("lighting", "normals", {"outward": "inward", "inward": "outward"}),
        where=_lit,
    ),
    fault(
        "N1-space",
        "normals are those of texture space, lights those of the world",
        switching(lighting={"normals": "untransformed"}),
        where=_lit,
    ),
    fault(
        "N1-texture-space",
        "normals and lights are in texture space",
        switching(lighting={"space": "texture"}),
        where=lambda subject: _lit(subject) and subject.pipeline.lighting.model == "cej",
    ),
    fault(
        "N1-kernel",
        "the gradient's kernel has a misprint",
        replaced("lighting", "gradient", {"sobel-bytes": "sobel-bytes-printed", "central": "forward"}),
        where=_lit,
    ),
    fault(
        "N1-unguarded",
        "a gradient of 0 is divided by its length",
        switching(lighting={"normals": "unguarded"}),
        where=_lit,
    ),
    fault(
        "N1-zero",
        "a gradient of 0 is read as another one",
        switching(lighting={"zero": "half"}),
        where=_lit_by_texture,
    ),
    fault(
        "N1-flat-skipped",
        "samples without a gradient are left out",
        switching(lighting={"flat": "skipped"}),
        where=_lit_by_texture,
    ),
)
