"""From the colour that the loop leaves to the canvas: tone map, discard, blending, number formats, frames.

F fragments; colours are (F, 4), the canvas is (H * W, 4).
"""

import numpy as np

from volref.arrays import Booleans, Floats, Indices
from volref.emulation.device import Device
from volref.emulation.groups import Accumulation, Output
from volref.emulation.marching import Marched
from volref.formats import stored
from volref.scene.scene import Scene


def fragment_colors(marched: Marched, accumulation: Accumulation) -> Floats:
    """Return what the shader has after its loop (F, 4)."""
    alpha = {"accumulated": marched.alpha, "weighted": marched.weighted}.get(accumulation.alpha)
    color = marched.color
    if accumulation.normalize:
        color = np.where(marched.alpha > 1, color / np.maximum(marched.alpha, 1), color)
    if alpha is None:
        alpha = np.ones_like(marched.alpha)
    return np.concatenate([color, alpha[None]]).T


def tone_mapped(rgba: Floats, output: Output) -> Floats:
    """Return colours (..., 4) squeezed and raised to 1 / gamma, alpha as it is."""
    color = rgba[..., :3]
    if output.tone_map == "reinhard":
        color = color / (1 + color)
    if output.gamma != 1.0:
        color = np.maximum(color, 0.0) ** rgba.dtype.type(1 / output.gamma)
    return np.concatenate([color, rgba[..., 3:]], axis=-1)


def cleared(scene: Scene, output: Output, device: Device) -> Floats:
    """Return an empty canvas (H * W, 4): the scene's background, as a clear colour."""
    background = np.array(scene.background, device.values_type)
    canvas = np.empty((scene.height * scene.width, 4), device.values_type)
    canvas[:] = store(background, output.format, device)
    return canvas


def store(colors: Floats, kind: str, device: Device) -> Floats:
    """Return colours as a target of a number format holds them on a device."""
    return stored(colors, kind, nan=1.0 if device.nan_stored == "one" else 0.0)


def draw(canvas: Floats, pixel: Indices, fragments: Floats, output: Output, device: Device) -> None:
    """Blend fragments into the canvas, at most one for each pixel."""
    if output.discard_below is not None:
        kept: Booleans = fragments[:, 3] >= output.discard_below
        pixel, fragments = pixel[kept], fragments[kept]
    canvas[pixel] = store(blended(fragments, canvas[pixel], output.blend), output.format, device)


def blended(source: Floats, behind: Floats, blend: str) -> Floats:
    """Return what a blend state makes of fragments (F, 4) and what is behind them (F, 4).

    Examples
    --------
    >>> half, red = np.array([[0.5, 0.5, 0.5, 0.5]]), np.array([[1.0, 0.0, 0.0, 1.0]])
    >>> blended(half, red, "premultiplied").tolist(), blended(half, red, "straight").tolist()
    ([[1.0, 0.5, 0.5, 1.0]], [[0.75, 0.25, 0.25, 0.75]])
    """
    alpha = source[:, 3:]
    if blend in ("none", "shader"):
        return source
    if blend == "premultiplied":
        return np.asarray(source + (1 - alpha) * behind)
    mixed = source * alpha + (1 - alpha) * behind
    if blend == "additive-alpha":
        mixed[:, 3] = source[:, 3] + behind[:, 3]
    return np.asarray(mixed)


def mean_of_frames(mean: Floats, frame: Floats, number: int, output: Output, device: Device) -> Floats:
    """Return the running mean after frame `number`, from 1, as its target holds it."""
    share = mean.dtype.type(1 / number)
    assert output.mean_format is not None
    return store(mean + (frame - mean) * share, output.mean_format, device)
