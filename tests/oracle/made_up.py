"""Made-up acceptance intervals, and the ways in which a canvas becomes a file."""

import numpy as np

from volref import Acceptance, Device, Pipeline

ROUNDINGS = {"down": np.floor, "nearest": np.rint, "up": np.ceil}


def acceptance_of(lo, hi, nominal=None, *, pipeline=None, **fields):
    """Return the record of intervals of numbers (H, W, 4); where both ends are 0, nothing is drawn."""
    lo, hi = np.asarray(lo, np.float64), np.asarray(hi, np.float64)
    nominal = (lo + hi) / 2 if nominal is None else nominal
    shape = lo.shape[:2]
    known = {
        "raw_lo": lo,
        "raw_hi": hi,
        "ambiguous": np.zeros(shape, np.bool_),
        "drawn": hi.any(axis=-1),
        "causes": {},
        "advice": "",
        "pipeline": pipeline or Pipeline("mine"),
        "device": Device(),
        "frames": 1,
        "seconds": 0.0,
    }
    return Acceptance(lo, hi, nominal, **known | fields)


def byte_intervals(seed, height=5, width=6, spread=6):
    """Return intervals of bytes, and a canvas within them, premultiplied; a pixel in four is clear."""
    random = np.random.default_rng(seed)
    alpha = random.integers(0, 256, (height, width, 1))
    color = random.integers(0, 256, (height, width, 3)) * alpha // 255
    codes = np.concatenate([color, alpha], axis=-1)
    codes[random.random((height, width)) < 0.25] = 0
    lo = np.maximum(codes - random.integers(0, spread, codes.shape), 0)
    hi = np.minimum(codes + random.integers(0, spread, codes.shape), 255)
    lo[codes[..., 3] == 0] = hi[codes[..., 3] == 0] = 0
    return codes, acceptance_of(lo / 255, hi / 255)


def encoded(light, encoding):
    """Return code values of light; IEC 61966-2-1 for sRGB."""
    if encoding == "none":
        return light
    if encoding == "gamma2.2":
        return light ** (1 / 2.2)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def sent(canvas, alpha, encoding):
    """Return what a premultiplied canvas of numbers (H, W, 4) becomes on its way, before it is stored."""
    color, opacity = canvas[..., :3], canvas[..., 3:]
    if alpha == "ignored":
        return np.concatenate([encoded(color, encoding), np.ones_like(opacity)], axis=-1)
    straight = color / np.where(opacity > 0, opacity, 1)
    changed = encoded(straight, encoding) * (1 if alpha == "straight" else opacity)
    if (alpha, encoding) == ("premultiplied", "none"):
        changed = color
    return np.concatenate([np.where(opacity > 0, changed, 0), opacity], axis=-1)
