"""From the colour that the loop leaves to the canvas: tone map, discard, blending, number formats, frames.

F fragments; colours are (F, 4), the canvas is (H * W, 4).
"""

import numpy as np

from volref.arrays import Booleans, Bytes, Floats, Indices
from volref.emulation.device import Device
from volref.emulation.groups import Accumulation, Output
from volref.emulation.loop.marching import Marched
from volref.emulation.targets.blending import blended, blended_codes
from volref.emulation.textures.lookup import mix
from volref.formats import codes_of, decoded, stored
from volref.scene.scene import RGBA, Scene
from volref.tonemap import OPERATORS

# Words of `blend` for shaders that know the background and leave nothing to a blend state.
IN_SHADER = ("shader", "shader-straight")


def fragment_colors(marched: Marched, accumulation: Accumulation) -> Floats:
    """Return what the shader has after its loop (F, 4)."""
    alpha = {"accumulated": marched.alpha, "weighted": marched.weighted}.get(accumulation.alpha)
    color = marched.color
    if accumulation.normalize != "none":
        least = 1 if accumulation.normalize == "above-one" else 0
        divided = marched.alpha > least
        color = np.where(divided, color / np.where(divided, marched.alpha, 1), color)
    if alpha is None:
        alpha = np.ones_like(marched.alpha)
    return np.concatenate([color, alpha[None]]).T


def over_environment(
    fragments: Floats, accumulated: Floats, environment: Floats, accumulation: Accumulation
) -> Floats:
    """Return what a shader makes of its colours (F, 4) and of what it knows to lie behind them (F, 4).

    It adds 1 - A of that, A being the `accumulated` alpha (F,); nothing where A is above 1.

    Examples
    --------
    >>> half, white = np.array([[0.5, 0.0, 0.0, 1.0]]), np.ones((1, 4))
    >>> over_environment(half, np.array([0.5]), white, Accumulation(alpha="one")).tolist()
    [[1.0, 0.5, 0.5, 1.0]]
    """
    behind = np.maximum(1 - accumulated, 0)[:, None] * environment
    if accumulation.alpha == "one":
        behind[:, 3] = 0.0
    return np.asarray(fragments + behind)


# A GPU goes on with the infinities of 16 bits, or of a light that a small gamma raises to a large power.
@np.errstate(over="ignore", invalid="ignore", divide="ignore")
def tone_mapped(rgba: Floats, output: Output, background: RGBA) -> Floats:
    """Return colours (..., 4) squeezed, put over the background by shaders that do, raised to 1 / gamma.

    The background is taken for a code value, of which the light is b^gamma: where nothing is in front of it,
    it comes out as it was.

    Examples
    --------
    Half covered by white, over black: the light of half of it is 0.73 of what a screen is told.

    >>> output = Output(gamma=2.2, blend="shader")
    >>> tone_mapped(np.array([0.5, 0.5, 0.5, 0.5]), output, (0.0, 0.0, 0.0, 1.0)).round(2).tolist()
    [0.73, 0.73, 0.73, 1.0]
    """
    color, alpha, kind = rgba[..., :3], rgba[..., 3:], rgba.dtype.type
    if output.tone_map != "none":
        curve, usual = OPERATORS[output.tone_map]
        color = curve(color, {name: getattr(output, name) for name in usual}).astype(kind)
    if output.blend in IN_SHADER:
        share = alpha if output.blend == "shader-straight" else kind(1)
        light = np.array(background[:3], alpha.dtype) ** kind(output.gamma)
        color, alpha = share * color + (1 - alpha) * light, np.ones_like(alpha)
    if output.gamma != 1.0:
        color = np.maximum(color, 0.0) ** kind(output.gamma**-output.encodings)
    return np.concatenate([color, alpha], axis=-1)


def cleared(scene: Scene, output: Output, device: Device) -> Floats:
    """Return an empty canvas (H * W, 4): the scene's background, as a clear colour."""
    background = np.array(scene.background, device.values_type)
    canvas = np.empty((scene.height * scene.width, 4), device.values_type)
    canvas[:] = store(background, output.format, device)
    return canvas


def missed(canvas: Floats, pixel: Indices, output: Output) -> None:
    """Put down what a program that draws every pixel leaves of those without a ray; `pixel` have one."""
    if output.missed == "clear":
        return
    outside = np.ones(len(canvas), np.bool_)
    outside[pixel] = False
    canvas[outside] = (0.0, 0.0, 0.0, 1.0 if output.missed == "black" else 0.0)


def store(colors: Floats, kind: str, device: Device) -> Floats:
    """Return colours as a target of a number format holds them on a device."""
    return stored(colors, kind, nan=1.0 if device.nan_stored == "one" else 0.0)


def draw(
    canvas: Floats, pixel: Indices, fragments: Floats, output: Output, device: Device, *, rounds: bool = True
) -> None:
    """Blend fragments into the canvas, at most one for each pixel; not rounded to its format if so asked."""
    if output.discard_below is not None:
        kept: Booleans = fragments[:, 3] >= output.discard_below
        pixel, fragments = pixel[kept], fragments[kept]
    if output.precision == "mediump" and device.fragment_color == "float16":
        fragments = stored(fragments, "half")
    if output.format == "unorm8":
        # Targets of whole numbers clamp colours before they blend them (OpenGL ES 3.0, section 4.1.7).
        fragments = np.clip(fragments, 0.0, 1.0)
    if not rounds:
        canvas[pixel] = blended(fragments, canvas[pixel], output.blend)
        return
    if output.format == "unorm8" and device.blend == "integer":
        codes = blended_codes(_bytes_of(fragments, device), _bytes_of(canvas[pixel], device), output.blend)
        canvas[pixel] = decoded(codes, canvas.dtype)
        return
    canvas[pixel] = store(blended(fragments, canvas[pixel], output.blend), output.format, device)


def _bytes_of(colors: Floats, device: Device) -> Bytes:
    return codes_of(colors, 8, nan=1.0 if device.nan_stored == "one" else 0.0)


def mean_of_frames(mean: Floats, frame: Floats, number: int, output: Output, device: Device) -> Floats:
    """Return the running mean after frame `number`, from 1, as its target holds it.

    The middle of two bytes lies as often as not half-way between two others: which of them is stored, the
    rounding of float32 decides, so it is computed in the control type.
    """
    assert output.mean_format is not None
    before = _as_read(mean, output.mean_format, device)
    now = _as_read(frame, output.format, device)
    mixed = mix(device, before, now, np.array(1 / number, before.dtype))
    return store(mixed.astype(mean.dtype), output.mean_format, device)


def _as_read(target: Floats, kind: str, device: Device) -> Floats:
    """Return what a shader reads of a target, in the control type."""
    if kind == "unorm8":
        return decoded(codes_of(target), device.control_type)
    return target.astype(device.control_type, copy=False)
