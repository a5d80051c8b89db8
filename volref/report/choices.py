"""Pictures of what each choice of a switch does, on one small scene."""

import numpy as np

from volref.arrays import Bytes, Floats
from volref.emulation.passes import emulate
from volref.emulation.pipeline import Pipeline
from volref.emulation.switches import Plain
from volref.errors import SceneError
from volref.image import bytes_from_unit
from volref.phantoms.meshes import sphere_mesh
from volref.phantoms.specimens import vessel
from volref.scene import Camera, Light, Material, Scene, TransferFunction
from volref.stages.jitter import jitter_images

WIDTH, HEIGHT = 144, 108

# Differences are small where programs nearly agree: they are shown this many times as large.
GAIN = 4

# Behind a canvas and beside the pictures.
BACKDROP = 0.35
MARGIN, LINE = 6, 14


def separating_scene(pipeline: Pipeline) -> Scene:
    """Return a small scene on which choices differ: an artery in 11 slices, with what the pipeline can draw.

    Voxels of three lengths, an atlas that is neither square nor full, steep and flat places, values up to the
    faces; a background that is half clear; a ball where meshes are drawn, lights where they are.
    """
    volume = vessel((26, 20, 11), spacing=(4.9, 4.8, 17.0), noise=0.0)
    colors = [(0.5, 0.2, 0.1), (0.9, 0.5, 0.3), (1.0, 0.9, 0.7)]
    transfer = TransferFunction.from_opacity(
        [-90, 150, 380, 1100], [colors[0], *colors], [0, 0.2, 0.6, 0.9], 8.0
    )
    middle = volume.corners.mean(axis=0)
    camera = Camera.look_at(middle + np.array((230.0, -330.0, 150.0)), middle, (0, 0, 1), 21.0, 50.0, 900.0)
    ball = sphere_mesh(20.0, middle + np.array((-4.0, 14.0, 10.0)), (0.2, 0.5, 0.9), subdivisions=2)
    lit = pipeline.lighting.model != "none"
    return Scene(
        volume,
        transfer,
        camera,
        WIDTH,
        HEIGHT,
        meshes=() if pipeline.meshes.kind == "none" else (ball,),
        lights=(Light.directional((-1, 1, -1), (0.9, 0.9, 0.8)), Light.ambient((0.2, 0.2, 0.3)))
        if lit
        else (),
        background=(0.1, 0.12, 0.2, 0.5),
        material=Material("phong", ambient=0.3, diffuse=0.7, specular=0.3, shininess=10.0) if lit else None,
    )


def choice_sheet(
    pipeline: Pipeline, name: str, values: list[Plain], default: Plain, scene: Scene | None = None
) -> Bytes:
    """Return a picture (H, W, 3) of what each value of a switch does: canvases, and how they differ.

    The canvas of the default comes first; below the others stands the difference from it, times 4.
    """
    order = [default, *(value for value in values if value != default)]
    canvases = [canvas_with(pipeline, name, value, scene) for value in order]
    across = WIDTH if scene is None else scene.width
    down = HEIGHT if scene is None else scene.height
    tiles = []
    for value, canvas in zip(order, canvases, strict=True):
        shown = np.full((2 * (down + LINE) + MARGIN, across + MARGIN, 3), BACKDROP)
        below = "the default" if value == default else f"difference x {GAIN}"
        if canvas is not None:
            shown[LINE : LINE + down, :across] = canvas
        if canvas is not None and canvases[0] is not None and value != default:
            apart = np.abs(canvas - canvases[0])
            shown[2 * LINE + down : 2 * (LINE + down), :across] = np.clip(GAIN * apart, 0, 1)
            below = below if apart.any() else "no difference here"
        words = _spelled(value) + ("" if canvas is not None else ": not with the others")
        lines = ((0, words), (LINE + down, "" if canvas is None else below))
        tiles.append(_labelled(shown, lines))
    return np.concatenate(tiles, axis=1)


def canvas_with(pipeline: Pipeline, name: str, value: Plain, scene: Scene | None) -> Floats | None:
    """Return the canvas (H, W, 3) over grey of a pipeline with a value of a switch, None if refused."""
    group, _, word = name.partition(".")
    try:
        changed = pipeline.with_switches(None, **{group: {word: value}})
        drawn = separating_scene(changed) if scene is None else scene
        jitter = jitter_images(drawn.width, drawn.height) if changed.stepping.jitter else None
        rgba = emulate(drawn, changed, None, jitter).rgba
    except SceneError:
        return None
    color = rgba[..., :3] + (1 - np.clip(rgba[..., 3:], 0, 1)) * BACKDROP
    return np.clip(np.nan_to_num(color), 0.0, 1.0)


def _labelled(tile: Floats, lines: tuple[tuple[int, str], ...]) -> Bytes:
    from PIL import Image, ImageDraw, ImageFont

    picture = Image.fromarray(bytes_from_unit(tile))
    pen, font = ImageDraw.Draw(picture), ImageFont.load_default(10)
    for top, text in lines:
        pen.text((2, top + 1), text, fill=(240, 240, 240), font=font)
    return np.asarray(picture)


def _spelled(value: Plain) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "none" if value is None else str(value)
