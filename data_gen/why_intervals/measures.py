"""What the criteria measure: numbers of two images, each by the package that the project itself uses.

Images are bytes (H, W, 3), as a screenshot holds them; the first is the project's golden.
"""

import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from data_gen.why_intervals.fuzzy import fuzzy_difference
from data_gen.why_intervals.mismatches import mismatches
from volref.arrays import Bytes

Measures = dict[str, float]

# pixelmatch's thresholds.
STRICT, PLAYWRIGHTS = 0.1, 0.2

# Blender's idiff -fail: a little more than 4/255.
BLENDERS = 0.016


def measured(
    reference: Bytes, candidates: Sequence[Bytes], names: Sequence[str] | None = None
) -> list[Measures]:
    """Return the measures of candidates, by name; all of them, or those named.

    mismatch_strict, mismatch_playwright: share of pixels that pixelmatch finds different.  vtk: the error of
    VTK's tests.  ssim, psnr, flip, fuzzy, correlation, rms (in 1/255), max (in 1/255).  above_blender: share
    of pixels that idiff finds different.
    """
    wanted = tuple(ALL if names is None else names)
    rows: list[Measures] = [{} for _ in candidates]
    if not {"mismatch_strict", "mismatch_playwright"}.isdisjoint(wanted):
        pixels = reference.shape[0] * reference.shape[1]
        counts = mismatches(reference, candidates, (STRICT, PLAYWRIGHTS))
        for row, (strict, playwrights) in zip(rows, counts, strict=True):
            row |= {"mismatch_strict": strict / pixels, "mismatch_playwright": playwrights / pixels}
    for row, candidate in zip(rows, candidates, strict=True):
        row |= {name: measure(reference, candidate) for name, measure in SINGLY.items() if name in wanted}
    return [{name: row[name] for name in wanted} for row in rows]


def structural_similarity(reference: Bytes, candidate: Bytes) -> float:
    """Return scikit-image's SSIM with its own settings, as ANARI's CTS calls it."""
    from skimage.metrics import structural_similarity as ssim

    return float(ssim(reference, candidate, channel_axis=-1))


def peak_signal_to_noise(reference: Bytes, candidate: Bytes) -> float:
    """Return scikit-image's PSNR in dB, 100 for equal images, which JSON can hold."""
    if np.array_equal(reference, candidate):
        return 100.0
    from skimage.metrics import peak_signal_noise_ratio

    return min(100.0, float(peak_signal_noise_ratio(reference, candidate)))


def mean_flip(reference: Bytes, candidate: Bytes) -> float:
    """Return the mean of NVIDIA's FLIP at 67 pixels per degree, its own setting."""
    import flip_evaluator

    ours, theirs = (image.astype(np.float32) / np.float32(255) for image in (reference, candidate))
    return float(flip_evaluator.evaluate(ours, theirs, "LDR", applyMagma=False)[1])


def vtk_error(reference: Bytes, candidate: Bytes) -> float:
    """Return the error of VTK's own tests, method TIGHT_VALID: SSIM in Lab, Euclidean."""
    from vtkmodules.vtkCommonCore import vtkLogger
    from vtkmodules.vtkTestingRendering import vtkTesting

    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    os.environ["VTK_TESTING_IMAGE_COMPARE_METHOD"] = "TIGHT_VALID"
    with tempfile.TemporaryDirectory() as folder:
        golden, image = (_png(Path(folder) / name, of) for name, of in (("a", reference), ("b", candidate)))
        testing = vtkTesting()
        for argument in ("-V", golden, "-T", folder):
            testing.AddArgument(argument)
        with _without_stdout():
            testing.RegressionTest(image, 1.0)
        return float(testing.GetImageDifference())


def correlation(reference: Bytes, candidate: Bytes) -> float:
    """Return the correlation of all bytes, alpha of 255 among them, as vispy's tests take it."""
    wide = ((0, 0), (0, 0), (0, 1))
    ours, theirs = (np.pad(image, wide, constant_values=255) for image in (reference, candidate))
    return float(np.corrcoef(ours.ravel(), theirs.ravel())[0, 1])


def root_mean_square(reference: Bytes, candidate: Bytes) -> float:
    """Return the RMS in 1/255 by matplotlib.testing."""
    from matplotlib.testing.compare import calculate_rms

    return float(calculate_rms(reference.astype(np.int16), candidate.astype(np.int16)))


def share_above(reference: Bytes, candidate: Bytes) -> float:
    """Return the share of pixels with a channel off by more than 0.016, as OpenImageIO's idiff counts."""
    apart = np.abs(reference.astype(np.int64) - candidate.astype(np.int64)) / 255
    return float((apart.max(axis=-1) > BLENDERS).mean())


def largest(reference: Bytes, candidate: Bytes) -> float:
    """Return the largest difference of a channel in 1/255."""
    return float(np.abs(reference.astype(np.int64) - candidate.astype(np.int64)).max())


SINGLY = {
    "vtk": vtk_error,
    "ssim": structural_similarity,
    "psnr": peak_signal_to_noise,
    "flip": mean_flip,
    "fuzzy": fuzzy_difference,
    "correlation": correlation,
    "rms": root_mean_square,
    "above_blender": share_above,
    "max": largest,
}

ALL = ("mismatch_strict", "mismatch_playwright", *SINGLY)


@contextmanager
def _without_stdout() -> Iterator[None]:
    """Throw away what compiled code prints."""
    sys.stdout.flush()
    kept = os.dup(1)
    with Path(os.devnull).open("w", encoding="utf-8") as nowhere:
        os.dup2(nowhere.fileno(), 1)
        try:
            yield
        finally:
            os.dup2(kept, 1)
            os.close(kept)


def _png(path: Path, image: Bytes) -> str:
    from PIL import Image

    file = str(path.with_suffix(".png"))
    Image.fromarray(image).save(file)
    return file
