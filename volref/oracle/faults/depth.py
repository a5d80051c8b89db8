"""Faults of opaque meshes beside the volume: rows D of the table."""

from volref.oracle.faults.fault import Subject
from volref.oracle.faults.making import fault, switched, switching


def _by_depth(subject: Subject) -> bool:
    return bool(subject.scene.meshes) and subject.pipeline.meshes.kind == "depth"


def _by_distance(subject: Subject) -> bool:
    return bool(subject.scene.meshes) and subject.pipeline.meshes.kind == "distance"


def _known(subject: Subject) -> bool:
    return bool(subject.scene.meshes) and subject.pipeline.meshes.kind != "none"


def _window(subject: Subject, _: float) -> Subject:
    by_depth = subject.pipeline.meshes.kind == "depth"
    return switched(subject, meshes={"depth": "window"} if by_depth else {"measure": "window"})


DEPTH = (
    fault(
        "D1-window-depth",
        "the meshes' depth is window depth, which is not linear along a ray",
        _window,
        where=_known,
    ),
    fault(
        "D1-window-over-w",
        "the meshes' depth is 1 - window z / clip w, as in seed 000",
        switching(meshes={"depth": "window-over-w"}),
        where=_by_depth,
    ),
    fault(
        "D1-view-depth",
        "the meshes' distance is measured along the view, not along the ray",
        switching(meshes={"measure": "view"}),
        where=_by_distance,
    ),
    fault(
        "D1-range",
        "the meshes' depth has another range than the rays'",
        lambda subject, scale: switched(subject, meshes={"scale": scale}),
        where=_known,
        strengths=(1.1, 0.9, 1.3, 0.75),
        fitted=True,
    ),
    fault(
        "D1-packing",
        "depth is packed into 8-bit channels with k / 256 for k / 255",
        switching(meshes={"packing": "printed"}),
        where=_by_depth,
    ),
    fault(
        "D2-squared-alpha",
        "what is in front of a mesh is multiplied by its alpha once more",
        switching(meshes={"composition": "printed"}),
        where=_by_depth,
    ),
    fault(
        "D2-one-step-early",
        "rays end one step before the mesh",
        switching(meshes={"comparison": "one-step-early"}),
        where=_by_depth,
    ),
)
