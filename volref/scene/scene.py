"""A scene: what is drawn, from where, and on how many pixels."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Floats, float_array, number, one_of, set_fields, whole_number
from volref.errors import SceneError
from volref.scene.camera import Camera
from volref.scene.lights import Light, Material
from volref.scene.mesh import Mesh
from volref.scene.plane import Plane
from volref.scene.radar import RadarVolume
from volref.scene.transfer import TransferFunction
from volref.scene.transfer2d import TransferFunction2D
from volref.scene.volume import Volume

LARGEST_IMAGE_SIDE = 65536

# What becomes of the values along a ray.
MODES = ("composite", "mip", "minip", "average", "isosurface", "slice")
GRADIENTS = ("central", "sobel", "analytic")
CLASSIFICATIONS = ("post", "pre", "per-slice")

RGBA: TypeAlias = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False, init=False)
class Scene:
    """One volume with its transfer function, meshes, lights, a camera and an image size.

    Parameters
    ----------
    volume, transfer
        The field and how it looks; both None for a scene of meshes only.
    camera
        See `Camera`.
    width, height
        Size of the image in pixels.
    meshes
        Surfaces; opaque ones end the volume integral where the ray meets them.
    lights
        Without any, the volume's colours are emitted as they are, and so are those of a radar volume, and of
        modes other than "composite" and "isosurface".  Meshes answer them if they are `lit`.
    material
        How the volume and lit meshes answer lights; default `Material()`.  With model "unlit" the volume does
        not, and meshes answer as `Material()`.
    background
        Premultiplied RGBA that lies behind everything.
    mode
        "composite": emission and absorption along the ray.  "mip", "minip" and "average": the greatest, least
        or mean value along the ray, then classified as a layer one unit distance thick.  "isosurface": an
        opaque surface where the ray first meets `isovalue`, in the colour that the transfer function has
        there.  "slice": the value where the ray meets `slice_plane`, classified as "mip" does.
    isovalue, slice_plane
        Of these two modes.
    clip
        Planes; what lies behind any of them is cut away, of the volume and of the meshes.
    gradient
        How the gradient is taken: "central" differences or the 3 x 3 x 3 "sobel" operator at the samples,
        interpolated between them, or the "analytic" gradient of the interpolated field, which jumps from cell
        to cell.  It is per world unit.
    classification
        "post": values are interpolated, then looked up.  "pre": samples are looked up, then interpolated.
        "per-slice": values are interpolated in the slices before and behind, looked up, then interpolated.

    Raises
    ------
    SceneError
        If a field breaks one of these rules.
    """

    volume: Volume | RadarVolume | None
    transfer: TransferFunction | TransferFunction2D | None
    camera: Camera
    width: int
    height: int
    meshes: tuple[Mesh, ...]
    lights: tuple[Light, ...]
    material: Material | None
    background: RGBA
    mode: str
    isovalue: float | None
    slice_plane: Plane | None
    clip: tuple[Plane, ...]
    gradient: str
    classification: str

    def __init__(
        self,
        volume: Volume | RadarVolume | None,
        transfer: TransferFunction | TransferFunction2D | None,
        camera: Camera,
        width: int,
        height: int,
        meshes: Sequence[Mesh] = (),
        lights: Sequence[Light] = (),
        material: Material | None = None,
        background: ArrayLike = (0.0, 0.0, 0.0, 0.0),
        mode: str = "composite",
        *,
        isovalue: float | None = None,
        slice_plane: Plane | None = None,
        clip: Sequence[Plane] = (),
        gradient: str = "central",
        classification: str = "post",
    ) -> None:
        _check_type("scene.volume", volume, Volume, RadarVolume, optional=True)
        _check_type("scene.transfer", transfer, TransferFunction, TransferFunction2D, optional=True)
        _check_type("scene.camera", camera, Camera)
        _check_type("scene.material", material, Material, optional=True)
        _check_type("scene.slice_plane", slice_plane, Plane, optional=True)
        for name, items, kind in (("meshes", meshes, Mesh), ("lights", lights, Light), ("clip", clip, Plane)):
            _check_list(f"scene.{name}", items, kind)
        if (volume is None) != (transfer is None):
            missing = "volume" if volume is None else "transfer"
            message = f"scene.{missing} must be given with the other one, got None; "
            raise SceneError(message + "give both, or neither for a scene of meshes only")
        if volume is None and not meshes:
            message = "scene must show a volume or a mesh, got neither; give one"
            raise SceneError(message)
        one_of("scene.mode", mode, MODES)
        _check_needed("scene.isovalue", isovalue, mode, "isosurface")
        _check_needed("scene.slice_plane", slice_plane, mode, "slice")
        set_fields(
            self,
            volume=volume,
            transfer=transfer,
            camera=camera,
            width=whole_number("scene.width", width, low=1, high=LARGEST_IMAGE_SIDE),
            height=whole_number("scene.height", height, low=1, high=LARGEST_IMAGE_SIDE),
            meshes=tuple(meshes),
            lights=tuple(lights),
            material=material,
            background=tuple(_checked_background(background).tolist()),
            mode=mode,
            isovalue=None if isovalue is None else number("scene.isovalue", isovalue),
            slice_plane=slice_plane,
            clip=tuple(clip),
            gradient=one_of("scene.gradient", gradient, GRADIENTS),
            classification=one_of("scene.classification", classification, CLASSIFICATIONS),
        )
        camera.check_aspect(self.width, self.height)
        _check_look(self)

    @property
    def corners(self) -> Floats:
        """The eight world corners (8, 3) of the box around all that the volume can show."""
        assert self.volume is not None
        if isinstance(self.volume, Volume):
            return self.volume.corners
        low, high = self.volume.box
        return np.array([[(low, high)[k >> axis & 1][axis] for axis in range(3)] for k in range(8)])

    @property
    def envelope(self) -> TransferFunction:
        """The transfer function of the value alone that is nowhere below the scene's."""
        assert self.transfer is not None
        return self.transfer.envelope if isinstance(self.transfer, TransferFunction2D) else self.transfer

    @property
    def lights_volume(self) -> bool:
        """Whether the volume answers lights."""
        unlit = self.material is not None and self.material.model == "unlit"
        shown_as_it_is = unlit or self.mode not in ("composite", "isosurface")
        return bool(self.lights) and isinstance(self.volume, Volume) and not shown_as_it_is

    @property
    def needs_gradient(self) -> bool:
        """Whether how the volume looks depends on its gradient."""
        transfer = self.transfer
        by_gradient = isinstance(transfer, TransferFunction) and transfer.gradient_opacity is not None
        return self.lights_volume or by_gradient or isinstance(transfer, TransferFunction2D)

    @property
    def gridded(self) -> tuple[Volume, TransferFunction]:
        """The volume and the transfer function of a scene known to have a grid and a table of values."""
        assert isinstance(self.volume, Volume)
        assert isinstance(self.transfer, TransferFunction)
        return self.volume, self.transfer


def _check_look(scene: Scene) -> None:
    """Refuse what does not go together."""
    transfer, sampled_after = scene.transfer, scene.classification == "post"
    by_gradient = transfer is not None and (
        not isinstance(transfer, TransferFunction) or transfer.gradient_opacity is not None
    )
    if isinstance(scene.volume, RadarVolume):
        what, cure = "a radar volume, which has no gradient", "resample it to a Volume first"
    elif scene.mode != "composite":
        what, cure = f"mode {scene.mode!r}", "use mode 'composite'"
    elif not sampled_after:
        what, cure = f"classification {scene.classification!r}", "use 'post'"
        sampled_after = True
    else:
        return
    names = {"transfer": by_gradient, "classification": not sampled_after}
    if scene.mode == "composite":
        names["material"] = scene.lights_volume
    for name in (name for name, wrong in names.items() if wrong):
        got = {"transfer": "one of the gradient", "material": "a lit one"}.get(name, scene.classification)
        message = f"scene.{name} must suit {what}, got {got}; {cure}"
        raise SceneError(message)
    if scene.mode in ("mip", "minip", "average") and any(mesh.transparent for mesh in scene.meshes):
        message = f"scene.meshes must be opaque in {what}, got a transparent one; give it opacity 1"
        raise SceneError(message)


def _check_type(name: str, value: object, *kinds: type, optional: bool = False) -> None:
    if isinstance(value, kinds) or (optional and value is None):
        return
    words = " or ".join(f"volref.{kind.__name__}" for kind in kinds)
    message = f"{name} must be a {words}, got {type(value).__name__}; build one first"
    raise SceneError(message)


def _check_list(name: str, items: object, kind: type) -> None:
    if not isinstance(items, Sequence):
        word = kind.__name__.lower()
        message = f"{name} must be a list of {word}{'e' * word.endswith('sh')}s, got {type(items).__name__}; "
        raise SceneError(message + f"give [{word}] or ()")
    for i, item in enumerate(items):
        _check_type(f"{name}[{i}]", item, kind)


def _check_needed(name: str, value: object, mode: str, needed: str) -> None:
    """Refuse what the mode needs and has not, or has and does not need."""
    if (value is None) == (mode != needed):
        return
    got = "none" if value is None else f"one in mode {mode!r}"
    message = f"{name} must be given in mode {needed!r} and in no other, got {got}; give it with that mode"
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
