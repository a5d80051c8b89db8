"""Cases of very large, very small, very flat and very distant volumes."""

import dataclasses
import math

import numpy as np

from volref.arrays import Floats
from volref.phantoms import closed
from volref.phantoms.scenes import Known, ramp_scene
from volref.phantoms.separable import separable_image
from volref.phantoms.transfer import two_colors
from volref.phantoms.views import view_around
from volref.scene import Camera, Scene, Volume
from volref.studies.stability.case import EPS, Case, Measured
from volref.studies.stability.pictures import CERTIFICATE, ESTIMATE, ROUNDING, known, rounding
from volref.studies.stability.shader import shader_image
from volref.studies.stability.views import COLOR, one_value

FAMILY = "Sizes"


def _needle(eye: tuple[float, float, float], target: tuple[float, float, float], extinction: float) -> Known:
    """Return a ramp along a needle of 5 x 5 x 5e6, seen in parallel projection."""
    length = math.dist(eye, target)
    camera = Camera.orthographic(eye, target, (0, 1, 0), 7.0, 0.0, 2 * length)
    table = two_colors(extinction=extinction)
    return ramp_scene(8, 8, transfer=table, spacing=(1, 1, 1e6), camera=camera)


def _needle_across() -> Measured:
    scene, pixels = _needle((20.0, 3.0, 4e5), (0.0, 0.0, 0.0), 0.8)
    return known([scene], pixels, step=500.0)


def _needle_along() -> Measured:
    scene, pixels = _needle((-0.5, -0.3, -4e6), (0.5, 0.3, 4e6), 8e-7)
    # The direction is off by 4 ulp, which over 8e6 moves the ray by 7e-9 across a needle 5 wide, and where it
    # leaves through a side, at a slope of 1e-7, that is 0.06 along it.
    slack = 8e-7 * 4 * EPS * 8e6 / 7.5e-8
    return known([scene], pixels, step=5e3, slack=slack)


def _moved(shift: float) -> tuple[Scene, Floats]:
    """Return a ramp `shift` away from the world's origin along each axis, and its image at the origin."""
    scene, pixels = ramp_scene(8, 8, transfer=two_colors(), camera=_nearby(0.0))
    ramp, _ = scene.gridded
    origin = tuple(o + shift for o in ramp.origin)
    volume = Volume(ramp.values, ramp.spacing, origin, centering="node")
    return dataclasses.replace(scene, volume=volume, camera=_nearby(shift)), pixels


def _nearby(shift: float) -> Camera:
    eye = np.array([8.0, 5.5, 9.25]) + shift
    return Camera.look_at(eye, np.full(3, shift), (0, 1, 0), 30.0, 0.1, 100.0)


def _far_from_the_origin() -> Measured:
    scene, pixels = _moved(1e7)
    # Each place is off by 8 u of sqrt(3) 1e7; directions have components above 0.2, so that a chord changes
    # by at most 2 / 0.2 per axis of it, and the value, 0.2 per unit along z, over a chord of at most 9.
    place = 4 * EPS * math.sqrt(3) * 1e7
    slack = place * (0.8 * 3 * 2 / 0.2 + 0.6 * 0.2 * 9)
    return known([scene], pixels, step=1 / 32, slack=slack)


def _scaled(scale: float) -> Measured:
    """Scale a ramp to a width; the naive program marches 0.01 world units at most 500 times."""
    spacing = scale / 5
    scene, pixels = ramp_scene(8, 8, transfer=two_colors(extinction=2 / scale), spacing=spacing)
    naive = shader_image(scene, step=0.01 / spacing, most_steps=500)
    return known([scene], pixels, textbook=naive, step=spacing / 64)


def _one_voxel() -> Measured:
    """Take volumes of 1 x 1 x 1, 1 x 1 x 6 and 6 x 1 x 1 samples, and a program that divides by n - 1."""
    scenes, pixels = [], []
    for shape in ((1, 1, 1), (6, 1, 1), (1, 1, 6)):
        volume = Volume(np.linspace(0.2, 0.8, math.prod(shape)).reshape(shape))
        scene = Scene(volume, two_colors(extinction=0.8), view_around(volume), 8, 8)
        scenes.append(scene)
        pixels.append(separable_image(scene).reshape(-1, 4))
    truth = np.concatenate(pixels)
    with np.errstate(all="ignore"):
        texture = np.array([0.0, 1.0, 1.0]) / (np.array([1.0, 6.0, 6.0]) - 1)  # index / (n - 1)
    naive = truth * np.repeat(np.where(np.isnan(texture), np.nan, 1.0), 64)[:, None]
    return known(scenes, truth, textbook=naive, step=1 / 64)


def _distant_eye() -> Measured:
    """Send parallel rays from 1e9 away, along z, through a slab of 4."""
    volume = Volume(np.full((4, 4, 4), 0.5), origin=(-1.5, -1.5, -1.5))
    camera = Camera.orthographic((0, 0, 1e9 + 0.3), (0, 0, 0), (0, 1, 0), 3.0, 0.0, 2e9)
    scene = Scene(volume, one_value(0.3), camera, 4, 4)
    truth = np.tile(closed.homogeneous(COLOR, 0.3, 4.0), (16, 1))
    # The ends are rounded to the spacing of floats at 1e9.
    slack = 0.3 * 2 * float(np.spacing(1e9))
    return known([scene], truth, march=rounding(8), slack=slack)


CASES = (
    Case(
        "spacing-1-1-1e6-across",
        FAMILY,
        "Through a needle of 5 x 5 x 5e6, slanted over a tenth of its length?",
        "a line along every ray; phantoms.separable.separable_image",
        "the shader: directions normalised in voxels, lengths counted as if along x",
        f"march: {ESTIMATE}.  exact: {CERTIFICATE}",
        _needle_across,
    ),
    Case(
        "spacing-1-1-1e6-along",
        FAMILY,
        "And from one end to the other, leaving through its sides?",
        "a line along every ray; phantoms.separable.separable_image",
        "the shader: directions normalised in voxels, lengths counted as if along x",
        f"march: {ESTIMATE}.  exact: {CERTIFICATE}.  4 ulp of the direction move the ray by 7e-9 over 8e6, "
        "which at the slope of the sides is 0.1 along it",
        _needle_along,
    ),
    Case(
        "world-offset-1e7",
        FAMILY,
        "1e7 away from the world's origin along each axis, is the image that at the origin?",
        "the image at the origin: moving camera and scene together changes nothing",
        "the shader: float32 places, which are 1 apart there",
        f"march: {ESTIMATE}; exact: {CERTIFICATE}; beside that, float64 places are off by 8e-9, which "
        "chords and values turn into at most 40 times as much",
        _far_from_the_origin,
    ),
    Case(
        "volume-1e-9-wide",
        FAMILY,
        "In a volume 1e-9 wide?",
        "a line along every ray; phantoms.separable.separable_image",
        "a shader with a step of 0.01 world units",
        f"march: {ESTIMATE}.  exact: {CERTIFICATE}",
        lambda: _scaled(1e-9),
    ),
    Case(
        "volume-1e9-wide",
        FAMILY,
        "In a volume 1e9 wide?",
        "a line along every ray; phantoms.separable.separable_image",
        "a shader with at most 500 steps of 0.01 world units",
        f"march: {ESTIMATE}.  exact: {CERTIFICATE}",
        lambda: _scaled(1e9),
    ),
    Case(
        "one-voxel-axes",
        FAMILY,
        "In volumes of 1 x 1 x 1, 1 x 1 x 6 and 6 x 1 x 1 samples?",
        "constant across, a broken line along; phantoms.separable.separable_image",
        "texture coordinates index / (n - 1), 0 / 0 for one sample",
        f"march: {ESTIMATE}.  exact: {CERTIFICATE}",
        _one_voxel,
    ),
    Case(
        "eye-1e9-away",
        FAMILY,
        "Along parallel rays that start 1e9 away from a slab of 4?",
        "c (1 - exp(-4 sigma)); phantoms.closed.homogeneous",
        "the shader: float32 places, which are 64 apart there",
        f"march: {ROUNDING}; exact: {CERTIFICATE}; beside that, the two ends are rounded to 1.2e-7, the "
        "distance of neighbouring floats at 1e9",
        _distant_eye,
    ),
)
