"""Animated PNG (APNG): the frames of a series in one file that browsers play."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Bytes, Floats, float_array, number, whole_number
from volref.errors import FormatError, SceneError
from volref.image import encode_rgba8
from volref.io.atomic import atomic_path
from volref.io.guard import one_line

SUFFIXES = (".png", ".apng")

# A frame's time is a fraction of two 16-bit numbers; Pillow writes milliseconds.
LONGEST_FRAME = 65.535


def write_animation(
    path: str | Path,
    frames: Iterable[Floats],
    *,
    seconds: float | Sequence[float] = 0.1,
    background: ArrayLike | None = None,
    encoding: str = "srgb",
    loops: int = 0,
    overwrite: bool = False,
) -> None:
    """Write premultiplied working-space images (height, width, 4) as an animated PNG, whole or not at all.

    Each frame replaces the one before, alpha included.  Frames are held in memory at 8 bits.  Pillow joins
    frames that are equal and adds their times; a single frame is a plain PNG.

    Parameters
    ----------
    frames
        At least one, all of one size; taken one after the other.
    seconds
        How long each is shown, rounded to milliseconds: one number, or one per frame.
    background
        Linear RGB (3,) to lay all frames over, which makes them opaque; None keeps their alpha.
    encoding
        "srgb", "gamma2.2" or "none", as `volref.write_image` has it.
    loops
        How often it is played; 0: for ever.

    Raises
    ------
    FormatError
        If the suffix is not .png or .apng, there is no frame, sizes differ, equal frames would be joined to
        one of more than 65 seconds, or the file exists and `overwrite` is False.
    SceneError
        If a number is out of range.
    """
    from PIL import Image

    target = Path(path)
    if target.suffix.lower() not in SUFFIXES:
        message = f"{one_line(target.name)} must end in .png or .apng, got {target.suffix!r}; rename it"
        raise FormatError(message)
    whole_number("loops", loops, low=0, high=2**31 - 1)
    with atomic_path(target, overwrite=overwrite) as temporary:
        codes = _codes(frames, None if background is None else _checked_color(background), encoding)
        times = _milliseconds(seconds, len(codes))
        _check_runs(codes, times)
        first, *others = [Image.fromarray(frame) for frame in codes]
        first.save(
            temporary,
            format="PNG",
            save_all=True,
            append_images=others,
            duration=times,
            loop=loops,
            disposal=0,  # OP_NONE
            blend=0,  # OP_SOURCE
        )


def _codes(frames: Iterable[Floats], background: Floats | None, encoding: str) -> list[Bytes]:
    codes: list[Bytes] = []
    for i, frame in enumerate(frames):
        image = np.array(float_array(f"frames[{i}]", frame, ("height", "width", 4)))
        if background is not None:
            image[..., :3] += (1.0 - image[..., 3:]) * background
            image[..., 3] = 1.0
        codes.append(np.ascontiguousarray(encode_rgba8(image, encoding)))
        if codes[i].shape != codes[0].shape or image.size == 0:
            message = (
                f"frames must have one size, got {codes[0].shape[1::-1]} and then {codes[i].shape[1::-1]} "
            )
            raise FormatError(message + f"(width, height) at index {i}; render them at one size")
    if codes:
        return codes
    message = "frames must hold an image, got none; render at least one"
    raise FormatError(message)


def _milliseconds(seconds: float | Sequence[float], count: int) -> list[int]:
    each = [seconds] * count if isinstance(seconds, int | float) else list(seconds)
    if len(each) != count:
        message = f"seconds must be one number or one per frame, got {len(each)} for {count} frames; "
        raise SceneError(message + "give as many")
    return [round(1000 * number("seconds", value, low=0.001, high=LONGEST_FRAME)) for value in each]


def _check_runs(codes: list[Bytes], times: list[int]) -> None:
    """Refuse equal frames in a row that would stand longer together than the format can say."""
    total = times[0]
    for before, after, time in zip(codes[:-1], codes[1:], times[1:], strict=True):
        total = total + time if np.array_equal(before, after) else time
        if total > 1000 * LONGEST_FRAME:
            message = (
                f"frames must differ within {LONGEST_FRAME} seconds, got equal ones for {total / 1000}; "
            )
            raise FormatError(message + "leave some out, or show them for less time")


def _checked_color(background: ArrayLike) -> Floats:
    color = float_array("background", background, (3,))
    if (color >= 0).all():
        return color
    message = f"background must have colours of at least 0, got {color.tolist()}; clip it"
    raise SceneError(message)
