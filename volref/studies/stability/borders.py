"""Cases of what has no answer: it is refused in a sentence, or its treatment is stated."""

from collections.abc import Callable
from functools import partial

import numpy as np

from volref.errors import SceneError
from volref.phantoms.transfer import grey_ramp
from volref.phantoms.views import view_around
from volref.scene import Camera, Scene, TransferFunction, Volume
from volref.studies.stability import pictures
from volref.studies.stability.case import EPS, Case, Measured, measured
from volref.studies.stability.shader import shader_image

FAMILY = "No answer"


def _refused(attempts: list[Callable[[], object]]) -> int:
    """Return how many of the attempts are refused with a SceneError."""
    count = 0
    for attempt in attempts:
        try:
            attempt()
        except SceneError:
            count += 1
    return count


def _with_one(bad: float) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    values = np.full((2, 2, 2), 0.5)
    values[1, 0, 1] = bad
    return values


def _bad_voxels() -> Measured:
    attempts: list[Callable[[], object]] = [
        partial(Volume, _with_one(bad)) for bad in (np.nan, np.inf, -np.inf, 1e301)
    ]
    attempts.append(lambda: Volume(_with_one(np.nan), nan=np.nan))
    return measured(5, 0, _refused(attempts), 0.0)


def _bad_numbers() -> Measured:
    colors = [(1.0, 1.0, 1.0)] * 2
    volume = Volume(np.zeros((2, 2, 2)))
    attempts: list[Callable[[], object]] = [
        lambda: TransferFunction([0, np.nan], colors, [0, 1]),
        lambda: TransferFunction([1, 0], colors, [0, 1]),
        lambda: TransferFunction([0, 1], colors, [0, np.inf]),
        lambda: TransferFunction([0, 1], colors, [0, -1]),
        lambda: TransferFunction([0, 1], colors, opacity=[0, 1.0000001]),
        lambda: Volume(np.zeros((2, 2, 2)), spacing=(1, 0, 1)),
        lambda: Volume(np.zeros((2, 2, 2)), spacing=(1, 1e-61, 1)),
        lambda: Volume(np.zeros((2, 2, 2)), origin=(1e61, 0, 0)),
        lambda: Scene(volume, grey_ramp(), view_around(volume), 0, 1),
    ]
    return measured(9, 0, _refused(attempts), 0.0)


def _parallel_up() -> Measured:
    attempts: list[Callable[[], object]] = [
        partial(Camera.look_at, (0, 0, 5), (0, 0, 0), up, 30.0, 0.1, 10.0)
        for up in ((0, 0, 1), (0, 0, -2), (0, 0, 0), (1e-12, 0, 1))
    ]
    attempts.append(lambda: Camera.look_at((0, 0, 5), (0, 0, 5), (0, 1, 0), 30.0, 0.1, 10.0))
    return measured(5, 0, _refused(attempts), 0.0)


def _nearly_parallel_up() -> Measured:
    """Multiply the axes of a view whose up is 1e-8 away from its direction: 1 or 0."""
    forward = np.array([0.6, -0.48, 0.64])
    up = forward + 1e-8 * np.array([0.8, 0.36, -0.48])
    camera = Camera.look_at((0, 0, 0), forward, up, 30.0, 0.1, 10.0)
    axes = camera.view_from_world[:3, :3]
    right = np.cross(forward, up)
    naive = np.stack([right, np.cross(right, forward), -forward])
    limit = 4 * EPS / 1e-8
    return measured(np.eye(3).ravel(), (naive @ naive.T).ravel(), (axes @ axes.T).ravel(), limit)


def _replaced() -> Measured:
    """Replace a voxel that is NaN by 0, as asked: the image is that of the volume with 0 there."""
    values = _with_one(0.0)
    broken = _with_one(np.nan)
    camera = view_around(Volume(values))
    asked = Scene(Volume(broken, nan=0.0), grey_ramp(), camera, 8, 8)
    plain = Scene(Volume(values), grey_ramp(), camera, 8, 8)
    reference = pictures.marched(plain)
    naive = shader_image(plain, values=broken)
    return measured(reference, naive, pictures.marched(asked), 0.0)


COUNT = "exact: a count"

CASES = (
    Case(
        "nan-and-infinite-voxels",
        FAMILY,
        "Are voxels of NaN, infinity, -infinity and 1e301, and NaN in place of NaN, refused?",
        "all 5: a NaN multiplied by 0 is NaN, and poisons every ray near it",
        "no check",
        COUNT,
        _bad_voxels,
    ),
    Case(
        "nan-replaced",
        FAMILY,
        "With nan=0, is the image that of a volume with 0 there?",
        "that image",
        "NaN left in the texture",
        "exact: the same numbers go through the same operations",
        _replaced,
    ),
    Case(
        "numbers-beyond-their-range",
        FAMILY,
        "Are tables that fall, negative or infinite extinctions, opacities above 1, lengths of 0, 1e-61 and "
        "1e61, and images without pixels refused?",
        "all 9",
        "no check",
        COUNT,
        _bad_numbers,
    ),
    Case(
        "up-along-the-view",
        FAMILY,
        "Are views refused whose up is along them or 0, or whose target is the eye?",
        "all 5: their axes are 0 / 0",
        "no check: the cross product is 0, and its direction NaN",
        COUNT,
        _parallel_up,
    ),
    Case(
        "up-1e-8-from-the-view",
        FAMILY,
        "Are the axes of a view at right angles and of length 1 if up is 1e-8 away from it?",
        "the unit matrix: products of the axes with each other",
        "cross products that are not made unit vectors",
        "a cross product of unit vectors is off by 2 eps per component, of which a sine of 1e-8 makes 1e8 "
        "times as much; two such axes are multiplied",
        _nearly_parallel_up,
    ),
)
