"""How many pixels pixelmatch finds different: the original in node, or its port to Python.

The original is the npm package that `npm install --prefix data_gen/why_intervals` puts beside this file; the
port is the PyPI package of the same name.  Both skip pixels that they take for antialiasing.
"""

import json
import shutil
import subprocess
from base64 import b64encode
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from volref.arrays import Bytes

HERE = Path(__file__).parent
PACKAGE = HERE / "node_modules" / "pixelmatch" / "package.json"

# An image pair takes some milliseconds.
PATIENCE_SECONDS = 300


def node_is_there() -> bool:
    """Whether node and the npm package are installed."""
    return shutil.which("node") is not None and PACKAGE.is_file()


def implementation() -> tuple[str, str]:
    """Return which pixelmatch counts here, and its version."""
    if node_is_there():
        return "pixelmatch (npm)", json.loads(PACKAGE.read_text(encoding="utf-8"))["version"]
    from importlib.metadata import version

    return "pixelmatch (its port on PyPI)", version("pixelmatch")


def mismatches(
    reference: Bytes, candidates: Sequence[Bytes], thresholds: Sequence[float]
) -> list[tuple[int, ...]]:
    """Return the number of different pixels of each candidate (H, W, 3) at each threshold."""
    count = counted_by_node if node_is_there() else counted_by_port
    return count(reference, candidates, thresholds)


def counted_by_node(
    reference: Bytes, candidates: Sequence[Bytes], thresholds: Sequence[float]
) -> list[tuple[int, ...]]:
    """Return what `mismatches` does, by the original."""
    height, width = reference.shape[:2]
    asked = {
        "width": width,
        "height": height,
        "reference": _base64(reference),
        "candidates": [_base64(candidate) for candidate in candidates],
        "thresholds": list(thresholds),
    }
    node = str(shutil.which("node"))
    answer = subprocess.run(
        [node, str(HERE / "mismatches.mjs")],
        input=json.dumps(asked),
        capture_output=True,
        check=True,
        text=True,
        timeout=PATIENCE_SECONDS,
    )
    return [tuple(counts) for counts in json.loads(answer.stdout)]


def counted_by_port(
    reference: Bytes, candidates: Sequence[Bytes], thresholds: Sequence[float]
) -> list[tuple[int, ...]]:
    """Return what `mismatches` does, by the port."""
    from pixelmatch import pixelmatch

    height, width = reference.shape[:2]
    ours = _opaque(reference).ravel().tolist()
    return [
        tuple(
            pixelmatch(ours, _opaque(candidate).ravel().tolist(), width, height, threshold=threshold)
            for threshold in thresholds
        )
        for candidate in candidates
    ]


def _base64(image: Bytes) -> str:
    return b64encode(_opaque(image).tobytes()).decode("ascii")


def _opaque(image: Bytes) -> Bytes:
    """Return the image as RGBA of alpha 255."""
    return np.concatenate([image, np.full((*image.shape[:2], 1), 255, np.uint8)], axis=-1)
