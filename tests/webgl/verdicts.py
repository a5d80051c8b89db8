"""Bundles of made-up intervals and images to judge by them, for Python's verdict and the browser's."""

import hashlib
import json

import numpy as np

from tests.oracle.made_up import acceptance_of, byte_intervals, sent
from volref import Pipeline
from volref.emulation.groups import Accumulation, Output

STRAIGHT = Pipeline("straight", accumulation=Accumulation(normalize="always"), output=Output(blend="none"))
FLOATS = Pipeline("floats", output=Output(format="float"))
HALVES = Pipeline("halves", output=Output(format="half", mean_format="unorm8"))

ARRAYS = ("nominal", "lo", "hi", "ambiguous", "drawn")


def write_intervals(folder, acceptance):
    """Write of a bundle what a verdict needs."""
    (folder / "expected").mkdir(parents=True)
    arrays = {name: getattr(acceptance, name) for name in ARRAYS}
    if acceptance.low_quality is not None:
        coarse = acceptance.low_quality()
        arrays |= {"low_quality_lo": coarse.lo, "low_quality_hi": coarse.hi}
    files = []
    for name, array in arrays.items():
        path = folder / "expected" / f"{name}.npy"
        np.save(path, array)
        data = path.read_bytes()
        digest = hashlib.sha256(data).hexdigest()
        files.append({"path": f"expected/{name}.npy", "bytes": len(data), "sha256": digest})
    height, width = acceptance.lo.shape[:2]
    document = {
        "format": "volref-golden",
        "format_version": 1,
        "image": {"width": width, "height": height, "format": acceptance.pipeline.output.format, "frames": 1},
        "pipeline": acceptance.pipeline.as_dict(),
        "expected": {name: f"expected/{name}.npy" for name in arrays},
        "acceptance": {"advice": acceptance.advice},
        "files": files,
    }
    (folder / "manifest.json").write_text(json.dumps(document), encoding="utf-8")


def acceptances():
    """Return intervals by name: of canvases of bytes, straight ones, floats, coarse filters, advice."""
    canvas, plain = byte_intervals(3, 11, 13)
    lo, hi = plain.lo, plain.hi
    random = np.random.default_rng(9)
    marked = random.random(lo.shape[:2]) < 0.1
    coarse = acceptance_of(np.maximum(lo - 9 / 255, 0), np.minimum(hi + 9 / 255, 1))
    floats = random.random((11, 13, 4))
    return canvas.astype(np.uint8), {
        "bytes": plain,
        "ambiguous": acceptance_of(lo, hi, ambiguous=marked),
        "straight": acceptance_of(lo, hi, pipeline=STRAIGHT),
        "coarse": acceptance_of(lo, hi, low_quality=lambda: coarse),
        "advice": acceptance_of(lo, hi, advice="the filter is unknown; probe the device"),
        "floats": acceptance_of(floats - 1e-3, floats + 1e-3, pipeline=FLOATS),
        "mean": acceptance_of(lo, hi, pipeline=HALVES),
        "empty": acceptance_of(np.zeros_like(lo), np.zeros_like(hi)),
    }


def off(image, amount, places=5):
    """Return bytes some of which are further away."""
    changed = image.astype(int)
    pixels = np.random.default_rng(amount + 1000).integers(0, image.shape[0] * image.shape[1], places)
    changed.reshape(-1, 4)[pixels, pixels % 4] += amount
    return np.clip(changed, 0, 255).astype(np.uint8)


def cases(canvas):
    """Return (name of intervals, image, options of check) of every case; options are JSON."""
    floats = canvas / 255
    mask = (np.arange(canvas.shape[0] * canvas.shape[1]).reshape(canvas.shape[:2]) % 3 == 0).astype(np.uint8)
    images = [(canvas, {}), *((off(canvas, amount), {}) for amount in (-60, -9, 3, 7, 8, 12, 100))]
    images += [
        (canvas[::-1], {}),
        (canvas[:, ::-1], {}),
        (canvas[::-1, ::-1], {}),
        (off(canvas, 9)[::-1], {}),
    ]
    images += [(canvas[..., [2, 1, 0, 3]], {}), (canvas[::-1, :, [2, 1, 0, 3]], {})]
    images += [(canvas, {"mask": mask.tolist()}), (off(canvas, 50), {"mask": mask.tolist()})]
    images += [(off(canvas, 50), {"mask": np.ones_like(mask).tolist()}), (canvas[..., :3], {})]
    images += [(off(canvas, 40), {"cause": "the table is half a texel off."})]
    images += [(255 - canvas, {}), (np.zeros_like(canvas), {}), (np.full_like(canvas, 255), {})]
    for alpha in ("premultiplied", "straight", "ignored"):
        for encoding in ("none", "srgb", "gamma2.2"):
            numbers = np.clip(sent(floats, alpha, encoding), 0, 1)
            stored = np.rint(255 * numbers).astype(np.uint8)
            asked = {"alpha": alpha, "encoding": encoding}
            images += [(stored, asked), (stored, {}), (numbers, asked), (numbers.astype(np.float32), asked)]
            images += [(off(stored, 30), asked)]
    rough = np.random.default_rng(4).normal(scale=2e-4, size=canvas.shape)
    images += [(floats, {}), (floats.astype(np.float32), {}), ((floats + rough).astype(np.float32), {})]
    images += [(floats + 40 * rough, {}), (floats + 1234.0625, {}), (floats - 1e9, {})]
    for number in (np.nan, np.inf, -np.inf):
        for channel in (1, 3):
            broken = floats.copy()
            broken[4, 5, channel] = number
            images += [(broken, {}), (broken, {"alpha": "straight"})]
    return images
