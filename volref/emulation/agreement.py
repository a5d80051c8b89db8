"""What scene and program both decide: the program is what draws, so a scene that asks for another is refused.

A scene that asks for nothing, which is what its defaults are, takes what the program has.
"""

from volref.emulation.device import Device
from volref.emulation.groups import Stepping
from volref.emulation.pipeline import Pipeline
from volref.emulation.textures.gradient_volume import has_gradient_volume
from volref.emulation.textures.radar_image import check_spherical, is_spherical
from volref.errors import SceneError
from volref.scene.radar import RadarVolume
from volref.scene.scene import Scene
from volref.scene.transfer import TransferFunction
from volref.scene.transfer2d import TransferFunction2D
from volref.scene.volume import Volume

# Ends that a program tests by the position of its next sample, or by the parameter t, have to move it.
MOVED_BY = {"parameter": ("parameter",), "outside": ("add",), "outside-above": ("add", "multiply")}


def check_kinds(scene: object, pipeline: object, device: object) -> None:
    """Refuse what is no scene, no pipeline or no device."""
    for name, value, kind in (
        ("scene", scene, Scene),
        ("pipeline", pipeline, Pipeline),
        ("device", device, Device),
    ):
        if not isinstance(value, kind):
            message = f"{name} must be a volref.{kind.__name__}, got {type(value).__name__}; build one first"
            raise SceneError(message)


def check_agreement(scene: Scene, pipeline: Pipeline) -> None:
    """Refuse scenes whose lights, gradients or order of classification are not the program's.

    Raises
    ------
    SceneError
        If there are such.
    """
    lighting, name = pipeline.lighting, f"pipeline {pipeline.name!r}"
    if scene.lights_volume and lighting.model == "none":
        message = f"scene.lights must be empty for {name}, which lights no volume, got {len(scene.lights)}; "
        raise SceneError(message + "leave them out, make the material 'unlit', or set pipeline.lighting")
    order = pipeline.table.order
    if scene.classification not in ("post", order):
        message = f"scene.classification must be 'post' or that of {name}, {order!r}, got "
        raise SceneError(message + f"{scene.classification!r}; set pipeline.table.order")
    own = "sobel" if has_gradient_volume(lighting) else lighting.gradient
    if scene.needs_gradient and scene.gradient not in ("central", own):
        message = f"scene.gradient must be 'central' or that of {name}, {own!r}, got {scene.gradient!r}; "
        raise SceneError(message + "set pipeline.lighting.gradient")
    transfer = scene.transfer
    by_gradient = isinstance(transfer, TransferFunction2D) or (
        isinstance(transfer, TransferFunction) and transfer.gradient_opacity is not None
    )
    if by_gradient and has_gradient_volume(lighting) and pipeline.table.rows == 1:
        message = (
            f"pipeline.table.rows must be 2 or more for a transfer of the gradient too, got 1 in {name}; "
        )
        raise SceneError(message + "set it, or give a transfer of the value alone")


def check_steps(stepping: Stepping) -> None:
    """Refuse steps that go nowhere or are counted in other units than what they are compared with.

    Raises
    ------
    SceneError
        If they do.

    Examples
    --------
    >>> check_steps(Stepping(end="parameter"))
    Traceback (most recent call last):
    volref.errors.SceneError: pipeline.stepping.advance must be 'parameter' for end 'parameter', got ...
    """
    allowed = MOVED_BY.get(stepping.end, ("add", "parameter", "multiply"))
    if stepping.advance not in allowed:
        words = " or ".join(map(repr, allowed))
        message = (
            f"pipeline.stepping.advance must be {words} for end {stepping.end!r}, got {stepping.advance!r}; "
        )
        raise SceneError(message + "no ray would end, change one of the two")
    if stepping.advance == "parameter" and stepping.rule != "count":
        message = f"pipeline.stepping.rule must be 'count' for advance 'parameter', got {stepping.rule!r}; "
        raise SceneError(message + "t is a share of the ray, choose 'add' or 'multiply' for a length")
    if stepping.rule == "voxel-count" and stepping.end.startswith("length"):
        message = "pipeline.stepping.end must be 'count' or 'outside' for rule 'voxel-count', got "
        raise SceneError(message + f"{stepping.end!r}; its steps have no length, only a number")
    if stepping.end == "outside-above" and stepping.cap is None:
        message = "pipeline.stepping.cap must be given for end 'outside-above', got None; "
        raise SceneError(message + "rays through the faces at 0 end by it alone")


def check_drawable(scene: Scene, pipeline: Pipeline) -> None:
    """Refuse scenes that hold what no program here draws."""
    wanted = RadarVolume if is_spherical(pipeline.volume) else Volume
    if not isinstance(scene.volume, wanted):
        message = f"scene.volume must be a {wanted.__name__} for pipeline {pipeline.name!r}, got "
        message += f"{'none' if scene.volume is None else type(scene.volume).__name__}; "
        cure = (
            "choose a pipeline for grids" if wanted is RadarVolume else "choose one for radars, or resample"
        )
        raise SceneError(message + f"give one, or {cure}")
    if wanted is RadarVolume:
        check_spherical(pipeline)
    if scene.mode != "composite" or scene.clip:
        got = "clipping planes" if scene.clip else f"mode {scene.mode!r}"
        message = f"scene must be a composite without clipping planes to be emulated, got {got}; "
        raise SceneError(message + "leave it out")
