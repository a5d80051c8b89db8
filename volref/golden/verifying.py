"""Goldens drawn again: bit for bit where NumPy and its instruction sets are the same, else within intervals.

Where they differ, some functions differ by some ulp, and with them the last digits of every image.  That is
what `accept` derives its intervals from for a GPU, whose functions are worse.  So the stated interval is that
of the golden's own device: every number of the image that was made there has to lie in the interval that is
derived here.  For a canvas of bytes nearly all intervals are one code wide, and two where the number lies
close to the middle between two codes.
"""

import tempfile
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from volref.arrays import Booleans
from volref.errors import FormatError
from volref.formats import codes_of
from volref.golden.digests import digests_of
from volref.golden.environment import same_digits
from volref.golden.making import Progress, work
from volref.golden.reading import load_bundle
from volref.golden.recipe import Recipe, subject_of
from volref.golden.suite import Suite, load_hashes
from volref.golden.writing import write_parts
from volref.io.guard import DEFAULT_MAX_BYTES
from volref.io.png import read_png
from volref.oracle.acceptance import Acceptance
from volref.oracle.accepting import accept
from volref.oracle.faults.fault import Subject

EQUAL, WITHIN, DIFFERS = "equal", "within", "differs"


@dataclass(frozen=True)
class Redrawn:
    """What came of drawing a golden again.

    status: "equal" to the bit; "within" its interval, with another NumPy or processor; or it "differs".
    changed: the parts whose digests are others.  digests: those of now.
    """

    name: str
    status: str
    message: str
    changed: tuple[str, ...]
    digests: Mapping[str, str | None]

    @property
    def passed(self) -> bool:
        """Whether the golden still holds."""
        return self.status != DIFFERS


def verify_suite(
    suite: Suite, *, executor: Executor | None = None, progress: Progress | None = None
) -> list[Redrawn]:
    """Draw the goldens of a suite again and hold them to the digests and pictures beside it.

    Raises
    ------
    FormatError
        If those are not there, or the goldens with digests are not those of the suite.
    """
    hashes = load_hashes(suite)
    if set(hashes.goldens) != set(suite.recipes):
        odd = min(set(hashes.goldens) ^ set(suite.recipes))
        message = f"{suite.hashes_file.name} must have digests of the suite's recipes and no others, got "
        raise FormatError(message + f"{odd!r} in one alone; compute them again")
    tasks: list[tuple[object, ...]] = [
        (recipe, hashes.goldens[name], hashes.environment, suite.preview(name))
        for name, recipe in suite.recipes.items()
    ]
    return work(_verify_recipe, tasks, executor, progress)


def verify_bundles(
    folders: list[Path], *, executor: Executor | None = None, progress: Progress | None = None
) -> list[Redrawn]:
    """Draw golden bundles again from the scene, program and device that lie in them.

    Raises
    ------
    FormatError
        If one is damaged.
    """
    return work(_verify_bundle, [(folder,) for folder in folders], executor, progress)


def draw_again(subject: Subject, *, interval: bool = False) -> dict[str, str | None]:
    """Return the digests of what a subject makes now, by part; of the interval only if asked."""
    with tempfile.TemporaryDirectory(prefix="volref-") as folder:
        return digests_of(Path(folder), write_parts(Path(folder), subject, interval=interval))


def _verify_recipe(
    recipe: Recipe, stated: Mapping[str, str | None], there: Mapping[str, Any], preview: Path
) -> Redrawn:
    subject = subject_of(recipe)
    digests = draw_again(subject, interval=stated["interval"] is not None)
    changed = tuple(part for part, digest in stated.items() if digest is not None and digest != digests[part])
    if not changed or same_digits(there):
        return _redrawn(recipe.name, changed, digests)
    codes = read_png(preview, DEFAULT_MAX_BYTES)
    accepted = _accepted(subject)
    lo, hi = codes_of(accepted.lo), codes_of(accepted.hi)
    fits = codes.shape == lo.shape
    outside = (codes < lo) | (codes > hi) if fits else np.ones(lo.shape, np.bool_)
    return _elsewhere(recipe.name, changed, digests, outside)


def _verify_bundle(folder: Path) -> Redrawn:
    bundle = load_bundle(folder)
    there = digests_of(folder, bundle.manifest)
    here = draw_again(bundle.subject, interval=True)
    changed = tuple(part for part, digest in there.items() if digest != here[part])
    if not changed or same_digits(bundle.manifest["environment"]):
        return _redrawn(bundle.name, changed, here)
    accepted, nominal = _accepted(bundle.subject), bundle.acceptance.nominal
    outside = (nominal < accepted.lo) | (nominal > accepted.hi)
    return _elsewhere(bundle.name, changed, here, outside)


def _accepted(subject: Subject) -> Acceptance:
    return accept(subject.scene, subject.pipeline, subject.device, subject.jitter, subject.frames)


def _redrawn(name: str, changed: tuple[str, ...], digests: Mapping[str, str | None]) -> Redrawn:
    """Return the result where NumPy and processor are the same, or nothing changed."""
    if not changed:
        return Redrawn(name, EQUAL, f"{name}: the same to the bit", changed, digests)
    message = f"{name}: must be the same to the bit with the same NumPy and instruction sets, got others in "
    return Redrawn(name, DIFFERS, message + ", ".join(changed), changed, digests)


def _elsewhere(
    name: str, changed: tuple[str, ...], digests: Mapping[str, str | None], outside: Booleans
) -> Redrawn:
    """Return the result where NumPy or the processor is another one, and some digits too."""
    count = int(np.count_nonzero(outside.any(axis=-1)))
    others = f"with another NumPy or processor, digits differ in {', '.join(changed)}"
    if not count:
        return Redrawn(name, WITHIN, f"{name}: {others}; every pixel lies in its interval", changed, digests)
    message = f"{name}: {others}, and {count} pixels lie outside their intervals"
    return Redrawn(name, DIFFERS, message, changed, digests)
