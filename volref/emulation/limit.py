"""What a program tends to as its step is refined and its targets hold more bits.

A program samples at a step, and quantises on the way.  Take both away and what is left is an integral: of the
volume and the table as it has uploaded them, with an extinction that its opacity rule implies.  That integral
is a scene like any other, so its certified truth can be had.  With the opacity a of the table,

    corrected    sigma = -factor log(1 - a) / d0    the scene's own, if the factor is 1
    as-is        sigma = -log(1 - factor a) / l     l: the length of a step, the one it is taken to mean
    per-length   sigma = factor a / (world length of a unit of texture space)
    per-step     sigma = factor a / (world length of `steps` steps)

The last three have one extinction for all rays only where that length is the same for all.
"""

import numpy as np

from volref.arrays import Floats
from volref.emulation.device import Device
from volref.emulation.drawing import prepare
from volref.emulation.loop.opacity import factor_of
from volref.emulation.pipeline import Pipeline
from volref.emulation.rays.box import Box, box_of
from volref.emulation.rays.paths import world_step_of
from volref.emulation.switches import Plain
from volref.emulation.textures.radar_image import polar_image, uploaded_radar
from volref.emulation.textures.uploads import Uploads, table_texture, uploads_of
from volref.errors import SceneError
from volref.formats import stored
from volref.scene.radar import RadarVolume
from volref.scene.scene import Scene
from volref.scene.transfer import TransferFunction
from volref.scene.volume import Volume

EXACT = Device.named("exact")


def limit_scene(scene: Scene, pipeline: Pipeline) -> Scene:
    """Return the scene whose truth a program tends to.

    Slices lie where the program's rule puts them.  At the border of the box a program may do what no scene
    does (bleed into a neighbour tile, blend with an empty slice): the limit holds for volumes that are
    transparent in their outer slices, rows and columns.  Around a radar it takes the least value: that must
    be transparent.

    Raises
    ------
    SceneError
        If the program tends to nothing that is an integral, or its extinction differs from ray to ray.
    """
    _refuse_printed(scene, pipeline)
    box, uploads = box_of(scene), uploads_of(scene, pipeline)
    return Scene(
        _volume(scene, pipeline, uploads, box),
        _transfer(scene, pipeline, uploads, box),
        scene.camera,
        scene.width,
        scene.height,
        scene.meshes,
        background=scene.background,
        classification=pipeline.table.order,
    )


def widened(pipeline: Pipeline) -> Pipeline:
    """Return a program whose textures and targets lose nothing, and that shows its colours as they are.

    Their sum lies over the background, premultiplied, without tone map and gamma.
    """
    exact = {"format": "exact"}
    output: dict[str, Plain] = {**exact, "tone_map": "none", "gamma": 1.0, "precision": "highp"}
    output |= {"blend": "premultiplied", "missed": "clear", "discard_below": None}
    if pipeline.output.mean_format is not None:
        output["mean_format"] = "exact"
    return pipeline.with_switches(
        rays=exact,
        volume=exact,
        table={"format": "exact", "opacity_format": None},
        accumulation={"alpha": "accumulated", "normalize": "none"},
        meshes={"format": "exact", "packing": "exact"},
        output=output,
    )


def refined(scene: Scene, pipeline: Pipeline, times: int) -> Pipeline:
    """Return a program whose step is `times` finer.

    An opacity that is not corrected for the step becomes one that is, for the step that it is taken to mean,
    on boxes with unequal sides the mean one of all rays; no alpha ends a ray.
    """
    stepping = pipeline.stepping
    changes: dict[str, Plain] = {"opaque_at": None, "steps": stepping.steps * times}
    if stepping.cap is not None:
        changes["cap"] = stepping.cap * times
    if stepping.rule in ("world-length", "texture-length"):
        world = stepping.rule == "world-length"
        length = world_step_of(stepping, scene) if world else stepping.length or 1.0 / stepping.steps
        changes["length"] = length / times
    opacity: dict[str, Plain] = {"factor": factor_of(scene, pipeline, box_of(scene))}
    if pipeline.opacity.rule == "as-is":
        assert scene.transfer is not None
        if opacity["factor"] != 1.0:
            message = (
                "pipeline.opacity.factor must be 1 for a step to be refined of an opacity taken as it is, "
            )
            raise SceneError(message + f"got {opacity['factor']:g}; put the factor into the table")
        exact = pipeline.with_switches(rays={"format": "exact"})
        step = float(prepare(scene, exact, EXACT).paths.world_step.mean())
        opacity = {"rule": "corrected", "factor": scene.transfer.unit_distance / step}
    return pipeline.with_switches(stepping=changes, opacity=opacity)


def _refuse_printed(scene: Scene, pipeline: Pipeline) -> None:
    """Refuse programs whose image is not that of an emission-absorption integral at any step."""
    volume, table, stepping = pipeline.volume, pipeline.table, pipeline.stepping
    reasons = {
        "alpha is added without what is in front": pipeline.accumulation.rule.startswith("add-"),
        "deeper samples lie in front": pipeline.accumulation.rule == "reversed-over",
        "samples are gathered, not composited": pipeline.accumulation.rule in ("mean", "greatest"),
        "colours are taken for premultiplied": pipeline.accumulation.color == "premultiplied"
        or table.premultiplied,
        "opacity hangs on more than the step's length in the world": pipeline.opacity.times != 1.0
        or pipeline.opacity.rule.startswith("corrected-"),
        "voxels are read beside their places": volume.reach != "faces"
        or volume.shift != 0
        or volume.brick is not None,
        "the table is read beside its places": table.shift != 0,
        "steps are left out or taken twice": stepping.skipped > 0 or stepping.last_step == "doubled",
        "surfaces lie elsewhere": bool(scene.meshes)
        and (pipeline.meshes.measure != "distance" or pipeline.meshes.scale != 1.0),
        "the tiles of the atlas are mixed up": volume.tile_row != "columns"
        or volume.second_column != "fract",
        "slices are mixed by x": volume.between == "x",
        "a radar is looked up as eq. 18 to 20 are printed": volume.geometry == "spherical-printed",
        "a radar has a seam at its first azimuth": volume.geometry == "spherical"
        and volume.seam == "clamped",
        "slices are not interpolated": volume.between == "none" or volume.filter == "nearest",
        "the table is not interpolated": table.filter == "nearest",
        "opacity is weighted by the gradient": pipeline.opacity.by_gradient > 0,
        "colours are lit": pipeline.lighting.model != "none",
        "surfaces are added as printed": bool(scene.meshes) and pipeline.meshes.composition == "printed",
    }
    for reason, holds in reasons.items():
        if holds:
            message = (
                f"pipeline {pipeline.name!r} must tend to an integral of emission and absorption, got one "
            )
            message += f"where {reason}; compare it with `render` as it is"
            raise SceneError(message)


def _volume(scene: Scene, pipeline: Pipeline, uploads: Uploads, box: Box) -> Volume | RadarVolume:
    """Return the volume as uploaded, its slices where the program takes them to lie."""
    low, high = uploads.domain
    kind = "unorm16" if pipeline.volume.format == "unorm16-split" else pipeline.volume.format
    if isinstance(scene.volume, RadarVolume):
        assert uploads.grid is not None
        image = polar_image(scene.volume, uploads.grid, "clamped")
        unit = np.where(np.isnan(image), 0.0, (image - low) / (high - low))
        return uploaded_radar(scene.volume, uploads.grid, low + (high - low) * stored(unit, kind))
    assert isinstance(scene.volume, Volume)
    values = low + (high - low) * stored((scene.volume.values - low) / (high - low), kind)
    count = np.array(scene.volume.size, dtype=np.float64)
    first, gaps = 0.5 / count, count.copy()
    if pipeline.volume.slices != "centers":
        first[2], gaps[2] = 0.0, count[2] - (pipeline.volume.slices == "last")
    linear = box.world_from_texture[:3, :3]
    origin = linear @ first + box.world_from_texture[:3, 3]
    return Volume(values, box.sides / gaps, origin, linear / box.sides)


def _transfer(scene: Scene, pipeline: Pipeline, uploads: Uploads, box: Box) -> TransferFunction:
    """Return the table as uploaded, with the extinction that the opacity rule implies."""
    assert scene.transfer is not None
    entries = np.asarray(table_texture(uploads, pipeline, EXACT).texels)[0]
    count, (low, high) = len(entries), uploads.domain
    index = np.arange(count)
    direct = pipeline.table.coordinate == "direct"
    place = low + (high - low) * ((index + 0.5) / count if direct else index / (count - 1))
    colors, opacity = entries[:, :3] * pipeline.lighting.factor, entries[:, 3]
    if pipeline.opacity.source == "value":
        place, colors = np.r_[low, place, high], np.pad(colors, ((1, 1), (0, 0)), mode="edge")
        opacity = (place - low) / (high - low)
    rule, factor = pipeline.opacity.rule, factor_of(scene, pipeline, box)
    if rule == "corrected":
        return TransferFunction.from_opacity(place, colors, opacity, scene.transfer.unit_distance / factor)
    exact = pipeline.with_switches(rays={"format": "exact"})
    paths = prepare(scene, exact, EXACT).paths
    if rule == "as-is":
        return TransferFunction.from_opacity(
            place, colors, opacity * factor, _one(paths.world_step, pipeline)
        )
    lengths = paths.world_step * pipeline.stepping.steps
    if rule == "per-length":
        lengths = paths.world_step / paths.texture_step
    return TransferFunction(place, colors, opacity * factor / _one(lengths, pipeline))


def _one(lengths: Floats, pipeline: Pipeline) -> float:
    """Return the world length (R,) that decides on the extinction, which must be that of all rays."""
    # 1e-9: the ends of rays are off by some units in the last place of float64.
    if len(lengths) and np.ptp(lengths) > 1e-9 * lengths.mean():
        message = f"pipeline {pipeline.name!r} must have one extinction for all rays to have a limit, got "
        message += (
            f"lengths from {lengths.min():g} to {lengths.max():g}; look along an axis with parallel rays"
        )
        raise SceneError(message)
    return float(lengths.mean())
