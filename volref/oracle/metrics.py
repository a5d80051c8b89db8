"""How far apart two images are, in numbers.

H, W pixels.  The largest, the mean and the percentiles of the difference are taken in the working space, on
the numbers as they are.  SSIM and Delta E 2000 judge what a viewer sees: both images over middle grey (code
value 0.5, so that a difference in alpha alone shows too), clipped to what a display can show, as sRGB codes.
"""

import dataclasses
import math
import warnings
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Booleans, Floats, float_array, one_of, plain_array
from volref.errors import SceneError
from volref.image import decode_srgb, encode_srgb

ENCODINGS = ("linear", "srgb")
CHANNELS = {1: ("value",), 3: ("red", "green", "blue"), 4: ("red", "green", "blue", "alpha")}

# One level of an 8-bit image.  Two numbers k/255 are each off by up to 2^-54 and their difference by as much
# again, so that neighbouring levels may differ by 2^-52 more than 1/255.
LEVEL = 1 / 255
LEVEL_ROUNDING = 2.0**-52

# Wang, Bovik, Sheikh and Simoncelli, "Image quality assessment: from error visibility to structural
# similarity", IEEE Transactions on Image Processing 13(4), 2004, section III.B: window and constants.
WINDOW = 11
SIGMA = 1.5
K1, K2 = 0.01, 0.03

# The code value behind both images where a viewer's impression is judged.
BACKDROP = 0.5

# Delta E 2000 takes some 50 arrays of its input's size: this many pixels keep them in the cache.
PIXELS_PER_CHUNK = 16384

# Beyond this a difference could overflow.
LARGEST = 1e300


@dataclass(frozen=True)
class Comparison:
    """The differences of two images of one shape; a difference is the largest over a pixel's channels.

    Parameters
    ----------
    width, height
        Pixels of either image.
    encoding
        What the numbers are: "linear" light, or "srgb" code values.
    max, p50, p95, p99
        Largest difference, and the percentiles of the pixels' differences.
    rms
        Root of the mean square over all channels of all pixels.
    psnr
        Peak signal-to-noise ratio in dB for a peak of 1, -20 log10(rms); infinite for equal images.
    share_above_level
        Part of the pixels, 0..1, that differ by more than 1/255.
    ssim
        Structural similarity, at most 1; None below 11 x 11 pixels.
    delta_e_mean, delta_e_p95, delta_e_max
        CIE Delta E 2000 over the pixels that are not all zero in both images; None for one channel.
    worst_pixel, worst_channel, worst_values
        Where the largest difference is, (x, y) with row 0 at the top, and the two numbers there.
    """

    width: int
    height: int
    encoding: str
    max: float
    p50: float
    p95: float
    p99: float
    rms: float
    psnr: float
    share_above_level: float
    ssim: float | None
    delta_e_mean: float | None
    delta_e_p95: float | None
    delta_e_max: float | None
    worst_pixel: tuple[int, int]
    worst_channel: str
    worst_values: tuple[float, float]

    @property
    def identical(self) -> bool:
        """Whether the images are equal, number for number."""
        return self.max == 0

    def as_dict(self) -> dict[str, Any]:
        """Return the comparison as plain data for JSON, where an infinite PSNR is null."""
        fields = dataclasses.asdict(self)
        psnr = self.psnr if math.isfinite(self.psnr) else None
        return {"identical": self.identical, **fields, "psnr": psnr}

    def __str__(self) -> str:
        """Return the comparison as a table for people."""
        x, y = self.worst_pixel
        values = f"{self.worst_values[0]:.6g} and {self.worst_values[1]:.6g}"
        where = f"pixel ({x}, {y}) {self.worst_channel}: {values}"
        rows = [
            ("image", f"{self.width} x {self.height}, {self.encoding}"),
            ("largest difference", f"{self.max:.6g}"),
            ("  at", "nowhere: the images are identical" if self.identical else where),
            ("p50, p95, p99", f"{self.p50:.6g}, {self.p95:.6g}, {self.p99:.6g}"),
            ("pixels above 1/255", f"{self.share_above_level:.4%}"),
            ("RMS", f"{self.rms:.6g}"),
            ("PSNR", f"{self.psnr:.2f} dB"),
            ("SSIM", "- (needs 11 x 11 pixels)" if self.ssim is None else f"{self.ssim:.6f}"),
        ]
        if self.delta_e_max is not None:
            figures = f"{self.delta_e_mean:.4f}, {self.delta_e_p95:.4f}, {self.delta_e_max:.4f}"
            rows.append(("Delta E 2000", f"{figures} (mean, p95, max)"))
        return "\n".join(f"{name:<19} {text}" for name, text in rows)


def compare(a: ArrayLike, b: ArrayLike, *, encoding: str = "linear") -> Comparison:
    """Return how far apart two images are.

    Parameters
    ----------
    a, b
        Images of one shape: (H, W, 4) premultiplied RGBA, (H, W, 3) colours that hide what is behind them,
        or (H, W), one channel such as grey.  All numbers finite.
    encoding
        "linear" if the numbers are linear light, "srgb" if they are sRGB code values in 0..1.

    Raises
    ------
    SceneError
        If the images have other shapes than these, or two different ones, or hold NaN or infinity.

    Examples
    --------
    >>> found = compare(np.zeros((2, 2)), [[0.0, 0.0], [0.0, 0.1]])
    >>> found.max, found.rms, round(found.psnr, 6), found.worst_pixel, found.share_above_level
    (0.1, 0.05, 26.0206, (1, 1), 0.25)
    """
    one_of("encoding", encoding, ENCODINGS)
    first, second = _checked_pair(a, b)
    height, width, count = first.shape
    apart = np.abs(first - second)
    pixels = apart.max(axis=-1)
    y, x, channel = (int(i) for i in np.unravel_index(apart.argmax(), apart.shape))
    rms = _root_mean_square(apart)
    p50, p95, p99 = (float(p) for p in np.percentile(pixels, (50, 95, 99)))
    seen = _displayed(first, encoding), _displayed(second, encoding)
    color = [None, None, None] if count == 1 else _delta_e_figures(*seen, (first != 0) | (second != 0))
    return Comparison(
        width=width,
        height=height,
        encoding=encoding,
        max=float(apart[y, x, channel]),
        p50=p50,
        p95=p95,
        p99=p99,
        rms=rms,
        psnr=-20 * math.log10(rms) if rms > 0 else math.inf,
        share_above_level=float(np.mean(pixels > LEVEL + LEVEL_ROUNDING)),
        ssim=structural_similarity(*seen),
        delta_e_mean=color[0],
        delta_e_p95=color[1],
        delta_e_max=color[2],
        worst_pixel=(x, y),
        worst_channel=CHANNELS[count][channel],
        worst_values=(float(first[y, x, channel]), float(second[y, x, channel])),
    )


def difference_image(a: ArrayLike, b: ArrayLike) -> Floats:
    """Return the largest absolute difference (H, W) over the channels of each pixel; shapes as `compare`."""
    first, second = _checked_pair(a, b)
    apart: Floats = np.abs(first - second).max(axis=-1)
    return apart


def structural_similarity(a: Floats, b: Floats) -> float | None:
    """Return the mean SSIM of two images (H, W, channels) of numbers in 0..1, None below 11 x 11 pixels.

    Per channel, with the means, variances and covariance weighted by an 11 x 11 Gaussian of sigma 1.5
    (Wang et al. 2004, eq 13-16):

        SSIM = (2 mu_a mu_b + C1) (2 sigma_ab + C2)
               / ((mu_a^2 + mu_b^2 + C1) (sigma_a^2 + sigma_b^2 + C2)),   C1 = 0.01^2, C2 = 0.03^2

    Only windows that lie wholly inside the image count, as in the authors' program: every pixel is part
    of some window, and nothing is made up beyond the border.  The mean is over windows and channels.

    Examples
    --------
    >>> black, white = np.zeros((11, 11, 1)), np.ones((11, 11, 1))
    >>> structural_similarity(black, black), round(structural_similarity(black, white), 9)
    (1.0, 9.999e-05)
    """
    if min(a.shape[:2]) < WINDOW:
        return None
    return float(np.mean([_similarity_map(a[..., k], b[..., k]).mean() for k in range(a.shape[-1])]))


def lab_from_code(code: Floats) -> Floats:
    """Return the CIE L*a*b* (..., 3), D65, of sRGB code values (..., 3) in 0..1, through colour-science."""
    colour = import_colour()
    return np.asarray(colour.XYZ_to_Lab(colour.sRGB_to_XYZ(code)), dtype=np.float64)


def delta_e_2000(lab_a: Floats, lab_b: Floats) -> Floats:
    """Return the CIE Delta E 2000 (...) of two arrays of CIE L*a*b* (..., 3), through colour-science.

    Source: CIE 142:2001; Sharma, Wu and Dalal, "The CIEDE2000 color-difference formula: implementation
    notes, supplementary test data, and mathematical observations", Color Research & Application 30(1), 2005.

    Examples
    --------
    >>> round(float(delta_e_2000(np.array([50.0, 2.5, 0.0]), np.array([50.0, 0.0, -2.5]))), 4)
    4.3065
    """
    difference = import_colour().difference.delta_E_CIE2000(lab_a, lab_b)
    return np.asarray(difference, dtype=np.float64)


def import_colour() -> ModuleType:
    """Return the module `colour` (colour-science), without its warning and its hold on NumPy.

    When first imported it warns where Matplotlib is missing, and sets NumPy's print options to those of 1.13.
    """
    with warnings.catch_warnings(), np.printoptions():
        warnings.simplefilter("ignore")
        import colour
    module: ModuleType = colour
    return module


def _checked_pair(a: ArrayLike, b: ArrayLike) -> tuple[Floats, Floats]:
    """Return both images as (H, W, channels)."""
    first, second = _checked_image("image a", a), _checked_image("image b", b)
    if first.shape != second.shape:
        sizes = " and ".join(" x ".join(map(str, image.shape)) for image in (first, second))
        message = f"images must have one size and as many channels, got height x width x channels {sizes}; "
        raise SceneError(message + "render both alike")
    return first, second


def _checked_image(name: str, image: ArrayLike) -> Floats:
    axes = plain_array(name, image).ndim
    shape = ("height", "width", "channels") if axes == 3 else ("height", "width")
    array = float_array(name, image, shape, limit=LARGEST)
    array = array if array.ndim == 3 else array[..., None]
    if array.shape[2] not in CHANNELS or array.size == 0:
        message = f"{name} must have at least one pixel and 1, 3 or 4 channels, got shape {array.shape}; "
        raise SceneError(message + "reshape it")
    return array


def _root_mean_square(apart: Floats) -> float:
    """Return the RMS; scaled by the largest, since squares of small numbers would vanish."""
    largest = float(apart.max())
    return largest * math.sqrt(float(np.mean((apart / largest) ** 2))) if largest > 0 else 0.0


def _displayed(image: Floats, encoding: str) -> Floats:
    """Return the sRGB code values in 0..1 of the image (H, W, 3 or 1) over the backdrop."""
    color = image
    if image.shape[-1] == 4:
        grey = float(decode_srgb(np.array(BACKDROP))) if encoding == "linear" else BACKDROP
        color = image[..., :3] + (1 - image[..., 3:]) * grey
    return np.clip(encode_srgb(color) if encoding == "linear" else color, 0.0, 1.0)


def _delta_e_figures(code_a: Floats, code_b: Floats, visible: Booleans) -> list[float | None]:
    footprint = visible.any(axis=-1)
    if not footprint.any():
        return [0.0, 0.0, 0.0]
    first, second = code_a[footprint], code_b[footprint]
    difference = np.empty(len(first))
    for start in range(0, len(first), PIXELS_PER_CHUNK):
        part = slice(start, start + PIXELS_PER_CHUNK)
        difference[part] = delta_e_2000(lab_from_code(first[part]), lab_from_code(second[part]))
    return [float(difference.mean()), float(np.percentile(difference, 95)), float(difference.max())]


def _similarity_map(a: Floats, b: Floats) -> Floats:
    mean_a, mean_b = _window_mean(a), _window_mean(b)
    product, square_a, square_b = mean_a * mean_b, mean_a**2, mean_b**2
    covariance = _window_mean(a * b) - product
    variances = (_window_mean(a * a) - square_a) + (_window_mean(b * b) - square_b)
    c1, c2 = K1**2, K2**2
    numerator = (2 * product + c1) * (2 * covariance + c2)
    similarity: Floats = numerator / ((square_a + square_b + c1) * (variances + c2))
    return similarity


def _window_mean(image: Floats) -> Floats:
    """Return the Gaussian mean (H - 10, W - 10) of every 11 x 11 window inside the image (H, W)."""
    from scipy import ndimage

    half = WINDOW // 2
    weight = np.exp(-(np.arange(-half, half + 1) ** 2) / (2 * SIGMA**2))
    weight /= weight.sum()
    for axis in (0, 1):
        image = ndimage.correlate1d(image, weight, axis=axis, mode="nearest")
    inside: Floats = image[half:-half, half:-half]
    return inside
