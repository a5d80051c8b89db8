"""The parts of a scene that are plain numbers, as JSON: camera, lights, material, planes, mode."""

from collections.abc import Mapping
from typing import Any

from volref.scene.camera import Camera
from volref.scene.lights import Light, Material
from volref.scene.plane import Plane
from volref.scene.scene import Scene
from volref.scene.volume import Volume

# What a scene says of how it is looked at; a scene of volref 0.1 states none of it.
LOOK = ("mode", "gradient", "classification")


def camera_of_document(document: Mapping[str, Any]) -> Camera:
    """Return the camera in a checked JSON object."""
    fields = {key: value for key, value in document.items() if key != "kind"}
    if document["kind"] == "matrix":
        return Camera.from_matrices(**fields)
    if "view_from_world" in fields:
        return Camera(fields.pop("view_from_world"), document["kind"], **fields)
    build = Camera.look_at if document["kind"] == "perspective" else Camera.orthographic
    return build(**fields)


def document_of_camera(camera: Camera) -> dict[str, Any]:
    """Return the JSON object that `camera_of_document` reads."""
    document: dict[str, Any] = {"kind": camera.kind, "view_from_world": camera.view_from_world.tolist()}
    if camera.clip_matrix is not None:
        document["clip_from_view"] = camera.clip_matrix.tolist()
    else:
        opening = {"fov_y": camera.fov_y, "height": camera.height}
        document |= {key: value for key, value in opening.items() if value is not None}
        document |= {"near": camera.near, "far": camera.far}
    return document | {"clip_z": camera.clip_z}


def document_of_placement(volume: Volume) -> dict[str, Any]:
    """Return where a volume lies, as JSON: spacing, origin, direction, centering."""
    return {
        "spacing": list(volume.spacing),
        "origin": list(volume.origin),
        "direction": volume.direction.tolist(),
        "centering": volume.centering,
    }


def look_of_document(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arguments of `Scene` that say how it is lit and looked at, of a checked JSON object."""
    look: dict[str, Any] = {
        key: document[key] for key in (*LOOK, "isovalue", "background") if key in document
    }
    look["lights"] = [Light(**light) for light in document.get("lights", [])]
    look["clip"] = [Plane(**plane) for plane in document.get("clip", [])]
    if "material" in document:
        look["material"] = Material(**document["material"])
    if "slice_plane" in document:
        look["slice_plane"] = Plane(**document["slice_plane"])
    return look


def document_of_look(scene: Scene) -> dict[str, Any]:
    """Return the JSON object that `look_of_document` reads."""
    document: dict[str, Any] = {"background": list(scene.background)}
    document |= {key: getattr(scene, key) for key in LOOK}
    if scene.isovalue is not None:
        document["isovalue"] = scene.isovalue
    if scene.slice_plane is not None:
        document["slice_plane"] = _document_of_plane(scene.slice_plane)
    if scene.material is not None:
        document["material"] = vars(scene.material)
    document["lights"] = [_document_of_light(light) for light in scene.lights]
    document["clip"] = [_document_of_plane(plane) for plane in scene.clip]
    return document


def _document_of_light(light: Light) -> dict[str, Any]:
    document: dict[str, Any] = {"kind": light.kind, "color": list(light.color)}
    if light.direction is not None:
        document["direction"] = light.direction.tolist()
    if light.position is not None:
        document["position"] = light.position.tolist()
        document["attenuation"] = list(light.attenuation)
    return document


def _document_of_plane(plane: Plane) -> dict[str, Any]:
    return {"point": plane.point.tolist(), "normal": plane.normal.tolist()}
