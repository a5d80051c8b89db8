"""`render_jittered`: marches with start offsets, and their mean over frames.

N frames, u the offset of a ray in a frame: the sample of every segment lies u of its length behind where it
begins.  The mean over u of such a rule is the integral of the extinction along the ray, so the mean of the
optical depths of frames goes to the true one.  That of images does not quite:

- exp bends: mean of exp(-tau - e) = exp(-tau) (1 + var(e) / 2 + ...).  Frames that differ by the standard
  deviation s have s = T sd(e) to leading order, T = exp(-tau), so this is s^2 / (2 T);
- a segment has one colour, while the light that reaches the eye from it is more from its front than from its
  back: with c' the slope of the colour, sigma c' h^2 / 12 per segment of length h.

Both are of second order in the step, and no number of frames takes them away.  The second is of the size of
the midpoint rule's own error, so what that rule says of itself, at a pixel or beside it, stands in for it.
"""

import dataclasses
import time
from concurrent.futures import Executor

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Floats, float_array, whole_number
from volref.errors import SceneError
from volref.planning import HALF_LEVEL, Plan, Stage
from volref.scene.scene import Scene
from volref.stages.jitter import jitter_images, repeated
from volref.truth.choosing import around_each
from volref.truth.crew import Progress
from volref.truth.rendering import decide, render
from volref.truth.result import Render

MOST_FRAMES = 100_000

# The share of pixels whose error an estimate should cover.
COVERED = 0.999

# Fewer frames are compared with the midpoint rule: what few of them hit may have been hit by none.
ENOUGH = 16

# Steps in which the progress of a frame is told.
TICKS = 1000


def render_jittered(
    scene: Scene,
    frames: int | None = None,
    *,
    jitter: ArrayLike | None = None,
    seed: int = 0,
    step: float | None = None,
    tolerance: float = HALF_LEVEL,
    threads: int | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
    plan: Plan | None = None,
) -> Render:
    """Return the mean of marches whose samples begin at other places in every pixel and frame.

    The bound is an estimate: Student's t for 99.9 % times the standard error of the mean over frames, plus
    what no number of frames takes away (the head of `volref.truth.jittered`), for which one march by the
    midpoint rule is made beside them.  Of fewer than 16 frames it is at least how far they are from that
    march, plus what it says of itself; of one frame it is that.  A feature that none has hit escapes it.

    Parameters
    ----------
    frames
        How many; default as many as `jitter` has, or 16.
    jitter
        Offsets in 0 to 1, (height, width) or (frames, height, width); a smaller image is repeated from the
        upper left corner, as a noise texture is.  None: `volref.jitter_images` makes them from `seed`.
    step, tolerance, threads, executor, progress, plan
        As `volref.render` has them for a march.

    Raises
    ------
    SceneError
        If an offset is not in 0 to 1, there are fewer images than frames, or `volref.render` refuses.
    """
    started = time.perf_counter()
    if scene.mode != "composite":
        message = f"scene.mode must be 'composite' to be jittered, got {scene.mode!r}; "
        raise SceneError(message + "render it without start offsets")
    decided = decide(scene, plan, "march" if plan is None else "auto", step, tolerance)
    if decided.method != "march":
        message = f"plan must be one of method 'march' to be jittered, got {decided.method!r}; "
        raise SceneError(message + "make it with volref.plan(scene, method='march')")
    given = None if jitter is None else _checked_jitter(jitter)
    count = _frames(frames, given)
    runs = count + 1

    def march(offsets: Floats | None, number: int) -> Render:
        show = None if progress is None else _part_of(progress, number, runs)
        flat = None if offsets is None else offsets.reshape(-1)
        followed = dataclasses.replace(decided, offsets=flat)
        return render(scene, threads=threads, executor=executor, progress=show, plan=followed)

    mean = np.zeros((scene.height, scene.width, 4))
    spread, samples = np.zeros_like(mean), 0
    for number in range(count):
        out = march(_offsets(scene, given, seed, number), number)
        # Welford 1962: sums of squares about the mean so far keep their digits.
        change = out.rgba - mean
        mean += change / (number + 1)
        spread += change * (out.rgba - mean)
        samples += out.samples
    middle = march(None, count)
    samples += middle.samples
    bound = around_each(middle.bound) + (_noise(mean, spread, count) if count > 1 else 0.0)
    if count < ENOUGH:
        apart = around_each(np.abs(mean - middle.rgba).max(axis=-1))
        bound = np.maximum(bound, apart + middle.bound)
    reason = f"the mean of {count} frame{'s' * (count > 1)} with start offsets "
    reason += f"from seed {seed}" if given is None else "as given"
    stage = Stage("jitter", included=True, reason=reason)
    others = (stage for stage in decided.stages if stage.name != "jitter")
    return dataclasses.replace(
        out,
        rgba=mean,
        bound=bound,
        bound_kind="estimate",
        seconds=time.perf_counter() - started,
        samples=samples,
        plan=dataclasses.replace(decided, stages=(*others, stage)),
    )


def _noise(mean: Floats, spread: Floats, count: int) -> Floats:
    """Return what chance leaves in the mean (H, W, 4) of frames, of the sum of their squared deviations.

    The bend of the exponential is taken twice, for what its leading term leaves out.
    """
    from scipy.special import stdtrit

    deviation = np.sqrt((spread / (count - 1)).max(axis=-1))
    sure = float(stdtrit(count - 1, (1 + COVERED) / 2)) / np.sqrt(count)
    clear = 1.0 - mean[..., 3]
    bend = np.divide(deviation**2, clear, out=deviation.copy(), where=clear > deviation)
    return np.asarray(sure * deviation + bend + count * 2.0**-52 * mean.max(axis=-1))


def _offsets(scene: Scene, given: Floats | None, seed: int, number: int) -> Floats:
    """Return the offsets (height, width) of one frame."""
    if given is not None:
        return repeated(given[number], scene.width, scene.height)
    return np.asarray(jitter_images(scene.width, scene.height, 1, seed, first=number)[0])


def _frames(frames: int | None, given: Floats | None) -> int:
    held = None if given is None else len(given)
    if frames is None:
        return 16 if held is None else held
    return whole_number("frames", frames, low=1, high=MOST_FRAMES if held is None else held)


def _checked_jitter(jitter: ArrayLike) -> Floats:
    image = np.asanyarray(jitter)
    offsets = float_array("jitter", image[None] if image.ndim == 2 else image, ("frames", "height", "width"))
    if offsets.size and offsets.min() >= 0 and offsets.max() <= 1:
        return offsets
    got = f"{offsets.min():g} to {offsets.max():g}" if offsets.size else "none"
    message = f"jitter must be offsets from 0 to 1, got {got}; give them as shares of a step"
    raise SceneError(message)


def _part_of(progress: Progress, number: int, count: int) -> Progress:
    """Return a progress for one of `count` frames that speaks to the one of all."""

    def show(done: int, total: int) -> None:
        progress(number * TICKS + TICKS * done // max(total, 1), count * TICKS)

    return show
