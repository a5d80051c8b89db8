"""`verify`: random rays of an image integrated again, to 30 digits and by another path.

N rays; all arrays are (N,) unless they say otherwise.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import islice
from typing import Any

import numpy as np

from volref.arrays import Booleans, Floats, Indices, Integers, whole_number
from volref.errors import SceneError
from volref.planning import more_than_values
from volref.scene.scene import MODES, Scene
from volref.scene.transform import transform_directions, transform_points
from volref.stages.rays import pixel_rays
from volref.truth.canvas import light_behind
from volref.truth.digits.integral import ray_integral
from volref.truth.digits.lattice import exact_point, exact_span
from volref.truth.digits.reduced import FloatRay, reduced_rgba
from volref.truth.meshes.surfaces import visible_surface
from volref.truth.result import Render

# Called after each ray with (rays done, rays in all).
Progress = Callable[[int, int], None]

# Rays shown when a verification is printed: the worst ones.
SHOWN = 8

# Rays made at a time while pixels are chosen.
RAYS_AT_ONCE = 4096


@dataclass(frozen=True, eq=False)
class Verification:
    """How far an image is from its scene's integral at some pixels, and what it had promised.

    Parameters
    ----------
    pixels
        The pixels (N, 2), x and y from the top left.
    truth
        Their premultiplied RGBA (N, 4), rounded to float64 after the difference was taken.
    error
        Largest difference over the four channels.
    bound
        What the image's own bound allows.
    remainder
        What `truth` itself may be off by before that rounding, about 10^-(digits + 3) or less.
    bound_kind
        "certified", or "estimate", which may be exceeded now and then.
    digits
        To which the rays were integrated.
    seconds
        Wall time.

    Examples
    --------
    Three rays; the last one misses its bound:

    >>> errors, bounds = np.array([1e-16, 0.0, 3e-6]), np.array([1e-15, 0.0, 1e-6])
    >>> pixels = np.array([[0, 0], [1, 0], [2, 0]])
    >>> checked = Verification(
    ...     pixels, np.zeros((3, 4)), errors, bounds, np.zeros(3), "certified", 30, 0.5
    ... )
    >>> checked.ok, checked.within.tolist(), checked.ratio.round(9).tolist()
    (False, [True, True, False], [0.1, 0.0, 3.0])
    """

    pixels: Integers
    truth: Floats
    error: Floats
    bound: Floats
    remainder: Floats
    bound_kind: str
    digits: int
    seconds: float

    @property
    def within(self) -> Booleans:
        """Whether each error is within its bound."""
        return self.error <= self.bound + self.remainder

    @property
    def ok(self) -> bool:
        """Whether every error is within its bound."""
        return bool(self.within.all())

    @property
    def ratio(self) -> Floats:
        """Error / bound; 0 where there is no error, infinite where no error was allowed."""
        ratio = np.where(self.error == 0, 0.0, np.inf)
        np.divide(self.error, self.bound, out=ratio, where=self.bound > 0)
        return ratio

    @property
    def largest_error(self) -> float:
        """The largest error; 0 if no ray was checked."""
        return float(self.error.max(initial=0.0))

    @property
    def median_error(self) -> float:
        """The median error; 0 if no ray was checked."""
        return float(np.median(self.error)) if len(self.error) else 0.0

    @property
    def median_bound(self) -> float:
        """The median bound; 0 if no ray was checked."""
        return float(np.median(self.bound)) if len(self.bound) else 0.0

    @property
    def share_within(self) -> float:
        """The share of rays whose error is within the bound; 1 if none was checked."""
        return float(self.within.mean()) if len(self.error) else 1.0

    def as_dict(self) -> dict[str, Any]:
        """Return the verification as plain data for JSON; an infinite ratio as null."""
        rays = [
            {
                "pixel": pixel,
                "error": error,
                "bound": bound,
                "ratio": ratio if np.isfinite(ratio) else None,
                "within": within,
                "truth": truth,
            }
            for pixel, error, bound, ratio, within, truth in zip(
                self.pixels.tolist(),
                self.error.tolist(),
                self.bound.tolist(),
                self.ratio.tolist(),
                self.within.tolist(),
                self.truth.tolist(),
                strict=True,
            )
        ]
        return {
            "ok": self.ok,
            "rays": len(self.error),
            "largest_error": self.largest_error,
            "median_error": self.median_error,
            "median_bound": self.median_bound,
            "share_within": self.share_within,
            "bound_kind": self.bound_kind,
            "digits": self.digits,
            "seconds": self.seconds,
            "pixels": rays,
        }

    def __str__(self) -> str:
        """Return one line in sum, and the worst rays as a table for people."""
        count = len(self.error)
        if not count:
            return "verified 0 rays: none meets the volume"
        head = (
            f"verified {count} ray{'s' * (count > 1)} at {self.digits} digits in {self.seconds:.1f} s: "
            f"error {self.largest_error:.3g} at most, {self.median_error:.3g} in the median; "
            f"{np.count_nonzero(self.within)} of {count} within the bound ({self.bound_kind})"
        )
        lines = [head, f"  {'x':>6}{'y':>6}{'error':>12}{'bound':>12}{'error/bound':>13}"]
        worst = np.argsort(-np.nan_to_num(self.ratio, nan=np.inf), kind="stable")[:SHOWN]
        lines += [
            f"  {self.pixels[i, 0]:6d}{self.pixels[i, 1]:6d}{self.error[i]:12.3g}{self.bound[i]:12.3g}"
            f"{self.ratio[i]:13.3g}{'' if self.within[i] else '  outside'}"
            for i in worst
        ]
        if count > SHOWN:
            lines.append(f"  ... and {count - SHOWN} with a smaller share of their bound")
        return "\n".join(lines)


def verify(
    scene: Scene,
    out: Render,
    rays: int = 64,
    *,
    seed: int = 0,
    pixels: Sequence[tuple[int, int]] | None = None,
    digits: int = 30,
    progress: Progress | None = None,
) -> Verification:
    """Compare `out`, an image of `scene`, with the same along some of its rays at 30 digits.

    It shares no code with the integrators: from the float64 ray on, the lattice is exact (rational
    arithmetic), and the integral is by Taylor series in multiple precision with a proven remainder; in modes
    that reduce a ray to one value, that is the extreme, mean or first root of exact cubics.  It takes from
    the rest of volref the rays, the distance in `out`, and the colour of the surface or the background, which
    are float64 data by definition.  A ray takes 0.01 to 5 seconds.

    Parameters
    ----------
    scene, out
        A scene with a volume, and what `render` made of it.
    rays
        How many pixels to check: random ones whose rays meet the volume, all if there are fewer.
    seed
        Of the choice.
    pixels
        The pixels (x, y) to check instead.
    digits
        Digits of the integral.
    progress
        Called with (rays done, rays in all).

    Raises
    ------
    SceneError
        If the scene has no volume, `out` has another size, a pixel lies outside, or mpmath is missing.
    """
    check_verifiable(scene)
    if more := next((name for name in ("supersampling", "jitter") if out.plan.includes(name)), ""):
        message = f"out must hold one ray of each pixel to be verified, got {more}; render it again without"
        raise SceneError(message)
    size = scene.height, scene.width
    if out.rgba.shape[:2] != size:
        message = f"out must be an image of the scene, {size[1]} x {size[0]} pixels, got "
        raise SceneError(message + f"{out.rgba.shape[1]} x {out.rgba.shape[0]}; render it again")
    whole_number("digits", digits, low=20, high=1000)
    started = time.perf_counter()
    distance = out.distance.reshape(-1)
    if pixels is None:
        whole_number("rays", rays, low=1, high=2**31)
        chosen = _random_pixels(scene, distance, rays, whole_number("seed", seed, low=0, high=2**63))
    else:
        chosen = _flat_pixels(scene, pixels)
    truth, error, remainder = _integrate_again(scene, out, chosen, digits, progress)
    return Verification(
        np.stack([chosen % scene.width, chosen // scene.width], axis=1),
        truth,
        error,
        out.bound.reshape(-1)[chosen],
        remainder,
        out.bound_kind,
        digits,
        time.perf_counter() - started,
    )


def check_verifiable(scene: Scene) -> None:
    """Refuse a scene whose image cannot be verified, before it is rendered.

    Raises
    ------
    SceneError
        If it has no volume or more than the other path knows, or mpmath is missing.
    """
    _check_mpmath()
    if scene.volume is None or scene.transfer is None:
        message = "scene must have a volume to verify, got meshes only; compare their images instead"
        raise SceneError(message)
    if more := more_than_values(scene, MODES):
        message = f"scene must show values on a grid as the table has them to be verified, got {more}; "
        raise SceneError(message + "verify one without")


def _integrate_again(
    scene: Scene, out: Render, chosen: Indices, digits: int, progress: Progress | None
) -> tuple[Floats, Floats, Floats]:
    """Return the truth (N, 4), the error of the image and the truth's own remainder at `chosen` (N,)."""
    volume, transfer = scene.gridded
    surface = visible_surface(scene) if scene.meshes else None
    behind = light_behind(scene, surface, chosen)
    distance, image = out.distance.reshape(-1)[chosen], out.rgba.reshape(-1, 4)[chosen]
    if scene.mode == "isosurface":  # which is no end of its own rays
        distance = np.full(len(chosen), np.inf) if surface is None else surface.distance.reshape(-1)[chosen]
    truth, error, remainder = np.empty(image.shape), np.empty(len(chosen)), np.empty(len(chosen))
    world = pixel_rays(scene.camera, scene.width, scene.height, chosen)
    for i, ray in enumerate(_index_rays(scene, chosen)):
        end, light = float(distance[i]), behind[i].tolist()
        if scene.mode == "composite":
            found = ray_integral(volume, transfer, *ray, end, light, digits)
            rgba, remainder[i] = found.rgba, found.remainder
        else:
            whole = FloatRay(*ray, world.origins[i].tolist(), world.directions[i].tolist(), end, light)
            rgba, remainder[i] = _reduced_again(scene, whole, digits)
        difference = [float(abs(a - b)) for a, b in zip(rgba, image[i].tolist(), strict=True)]
        # NumPy's maximum keeps a NaN of the image, Python's may lose it.
        truth[i], error[i] = [float(channel) for channel in rgba], np.max(difference)
        if progress is not None:
            progress(i + 1, len(chosen))
    return truth, error, remainder


def _reduced_again(scene: Scene, ray: FloatRay, digits: int) -> tuple[tuple[Any, ...], float]:
    """Return the rgba of a ray in a mode that reduces it to one value, and a bound on its error."""
    from mpmath import mp

    # Roots that nearly coincide lose half of the digits.
    with mp.workdps(2 * digits + 10):
        return reduced_rgba(mp, scene, ray), 10.0**-digits


def _check_mpmath() -> None:
    if find_spec("mpmath") is None:
        message = "mpmath must be installed to verify images, got no module 'mpmath'; "
        raise SceneError(message + "run: pip install 'volref[verify]'")


def _random_pixels(scene: Scene, distance: Floats, rays: int, seed: int) -> Indices:
    """Return up to `rays` flat pixels whose rays meet the volume, in random order."""
    low, high = (exact_point(corner.tolist()) for corner in scene.gridded[0].index_bounds)
    order = np.random.default_rng(seed).permutation(scene.width * scene.height)
    meeting = (
        pixel
        for part in np.array_split(order, 1 + len(order) // RAYS_AT_ONCE)
        for pixel, (origin, direction) in zip(part.tolist(), _index_rays(scene, part), strict=True)
        if exact_span(exact_point(origin), exact_point(direction), low, high, distance[pixel])
    )
    return np.fromiter(islice(meeting, rays), np.intp)


def _flat_pixels(scene: Scene, pixels: Sequence[tuple[int, int]]) -> Indices:
    flat = []
    for pixel in pixels:
        if not isinstance(pixel, Sequence) or len(pixel) != 2:
            message = f"pixels must be pairs of numbers x, y, got {pixel!r}; count from the top left, from 0"
            raise SceneError(message)
        x, y = pixel
        column = whole_number("pixel x", x, low=0, high=scene.width - 1)
        flat.append(whole_number("pixel y", y, low=0, high=scene.height - 1) * scene.width + column)
    return np.array(flat, dtype=np.intp)


def _index_rays(scene: Scene, pixels: Indices) -> Iterator[tuple[list[float], list[float]]]:
    """Yield origin and direction in index space: the float64 rays that every integrator starts from."""
    rays = pixel_rays(scene.camera, scene.width, scene.height, pixels)
    matrix = scene.gridded[0].index_from_world
    origins = transform_points(matrix, rays.origins)
    directions = transform_directions(matrix, rays.directions)
    yield from zip(origins.tolist(), directions.tolist(), strict=True)
