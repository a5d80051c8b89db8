"""Faults of opaque meshes beside the volume: rows D of the table."""

import dataclasses

from volref.oracle.faults.fault import Subject
from volref.oracle.faults.making import fault, switching
from volref.scene.mesh import Mesh


def _by_depth(subject: Subject) -> bool:
    return bool(subject.scene.meshes) and subject.pipeline.meshes.kind == "depth"


def _by_distance(subject: Subject) -> bool:
    return bool(subject.scene.meshes) and subject.pipeline.meshes.kind == "distance"


def _seen(subject: Subject) -> bool:
    return bool(subject.scene.meshes) and not subject.scene.camera.is_parallel


def _at_scaled_depth(subject: Subject, scale: float) -> Subject:
    """Return a subject whose meshes cover the same pixels at another distance: scaled about the eye."""
    eye = subject.scene.camera.world_from_view[:3, 3]

    def moved(mesh: Mesh) -> Mesh:
        return dataclasses.replace(mesh, vertices=eye + scale * (mesh.vertices - eye))

    scene = dataclasses.replace(subject.scene, meshes=tuple(map(moved, subject.scene.meshes)))
    return dataclasses.replace(subject, scene=scene)


DEPTH = (
    fault(
        "D1-window-depth",
        "the meshes' depth is window depth, which is not linear along a ray",
        switching(meshes={"depth": "window-over-w"}),
        where=_by_depth,
    ),
    fault(
        "D1-range",
        "the meshes' depth has another range than the rays'",
        _at_scaled_depth,
        where=_seen,
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
