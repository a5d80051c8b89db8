"""A scene: what is drawn, from where, and on how many pixels."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Floats, float_array, set_fields, whole_number
from volref.errors import SceneError
from volref.scene.camera import Camera
from volref.scene.mesh import Mesh
from volref.scene.transfer import TransferFunction
from volref.scene.volume import Volume

LARGEST_IMAGE_SIDE = 65536

RGBA: TypeAlias = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False, init=False)
class Scene:
    """One volume with its transfer function, opaque meshes, a camera and an image size.

    Parameters
    ----------
    volume, transfer
        The field and how it looks; both None for a scene of meshes only.
    camera
        See `Camera`.
    width, height
        Size of the image in pixels.
    meshes
        Opaque surfaces; they end the volume integral where the ray meets them.
    background
        Premultiplied RGBA that lies behind everything.

    Raises
    ------
    SceneError
        If a field breaks one of these rules.
    """

    volume: Volume | None
    transfer: TransferFunction | None
    camera: Camera
    width: int
    height: int
    meshes: tuple[Mesh, ...]
    background: RGBA

    def __init__(
        self,
        volume: Volume | None,
        transfer: TransferFunction | None,
        camera: Camera,
        width: int,
        height: int,
        meshes: Sequence[Mesh] = (),
        background: ArrayLike = (0.0, 0.0, 0.0, 0.0),
    ) -> None:
        _check_type("scene.volume", volume, Volume, optional=True)
        _check_type("scene.transfer", transfer, TransferFunction, optional=True)
        _check_type("scene.camera", camera, Camera)
        if not isinstance(meshes, Sequence):
            message = f"scene.meshes must be a list of meshes, got {type(meshes).__name__}; give [mesh] or ()"
            raise SceneError(message)
        for i, mesh in enumerate(meshes):
            _check_type(f"scene.meshes[{i}]", mesh, Mesh)
        if (volume is None) != (transfer is None):
            missing = "volume" if volume is None else "transfer"
            message = f"scene.{missing} must be given with the other one, got None; "
            raise SceneError(message + "give both, or neither for a scene of meshes only")
        if volume is None and not meshes:
            message = "scene must show a volume or a mesh, got neither; give one"
            raise SceneError(message)
        set_fields(
            self,
            volume=volume,
            transfer=transfer,
            camera=camera,
            width=whole_number("scene.width", width, low=1, high=LARGEST_IMAGE_SIDE),
            height=whole_number("scene.height", height, low=1, high=LARGEST_IMAGE_SIDE),
            meshes=tuple(meshes),
            background=tuple(_checked_background(background).tolist()),
        )
        camera.check_aspect(self.width, self.height)


def _check_type(name: str, value: object, kind: type, *, optional: bool = False) -> None:
    if isinstance(value, kind) or (optional and value is None):
        return
    message = f"{name} must be a volref.{kind.__name__}, got {type(value).__name__}; build one first"
    raise SceneError(message)


def _checked_background(background: ArrayLike) -> Floats:
    array = float_array("scene.background", background, (4,))
    if (array < 0).any() or array[3] > 1:
        message = (
            f"scene.background must have colours of at least 0 and an alpha in 0..1, got {array.tolist()}; "
        )
        raise SceneError(message + "clip it")
    if array[3] == 0 and np.any(array[:3]):
        message = f"scene.background must be premultiplied, got {array.tolist()} with alpha 0; "
        raise SceneError(message + "multiply its colour by its alpha")
    return array
