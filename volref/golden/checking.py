"""Candidates held against golden bundles: which belongs to which, and the verdict."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from volref.errors import FormatError
from volref.golden.bundle import Bundle
from volref.golden.contents import MANIFEST
from volref.golden.reading import load_bundle
from volref.io.guard import one_line
from volref.oracle.candidate import ImageSource
from volref.oracle.verdict import Verdict, check

# Endings of candidates, in the order in which they are looked for.
SUFFIXES = (".npy", ".exr", ".npz", ".png")


class Pair(NamedTuple):
    """A bundle's folder and the image to judge by it."""

    bundle: Path
    candidate: Path


def check_bundle(
    bundle: Bundle | str | Path,
    candidate: ImageSource,
    *,
    alpha: str | None = None,
    encoding: str | None = None,
    mask: ImageSource | None = None,
) -> Verdict:
    """Return whether an image is one that a correct machine may draw of a golden bundle; see `check`.

    Raises
    ------
    FormatError
        If the bundle or the image cannot be read.
    SceneError
        If the image has another size, or is none.

    Examples
    --------
    >>> import tempfile
    >>> from volref.golden.generators import scene_of
    >>> from volref.golden.writing import write_bundle
    >>> with tempfile.TemporaryDirectory() as here:
    ...     bundle = load_bundle(write_bundle(Path(here) / "blobs", scene_of("blobs"), "x3dom"))
    >>> check_bundle(bundle, bundle.acceptance.nominal).passed
    True
    """
    golden = bundle if isinstance(bundle, Bundle) else load_bundle(bundle)
    return check(candidate, golden.acceptance, alpha=alpha, encoding=encoding, mask=mask)


def pairs_of(places: Sequence[str | Path]) -> list[Pair]:
    """Return which image belongs to which bundle, of a command's words.

    Bundles come first: folders with a manifest, or folders of such.  Then candidates: as many files in the
    same order, or one folder with a file of each bundle's name.

    Raises
    ------
    FormatError
        If there are no bundles or no candidates, or not as many, or one is missing.
    """
    bundles: list[Path] = []
    candidates: list[Path] = []
    for place in map(Path, places):
        found = bundles_in(place)
        if found and not candidates:
            bundles += found
        else:
            candidates.append(place)
    if not bundles or not candidates:
        got = "no bundle" if not bundles else "no candidate"
        message = f"BUNDLE... CANDIDATE... must be folders of bundles, then images, got {got}; name both"
        raise FormatError(message)
    if len(candidates) == 1 and candidates[0].is_dir():
        return [Pair(bundle, _named(candidates[0], bundle.name)) for bundle in bundles]
    if len(candidates) != len(bundles):
        message = (
            f"CANDIDATE... must be one image for each of {len(bundles)} bundles, or one folder of images, "
        )
        raise FormatError(message + f"got {len(candidates)}; name as many, in the same order")
    return [Pair(*pair) for pair in zip(bundles, candidates, strict=True)]


def bundles_in(place: Path) -> list[Path]:
    """Return the bundle that a folder is, or those in it, by name."""
    if (place / MANIFEST).is_file():
        return [place]
    if not place.is_dir():
        return []
    visible = (entry for entry in place.iterdir() if not entry.name.startswith("."))
    return sorted(entry for entry in visible if (entry / MANIFEST).is_file())


def _named(folder: Path, name: str) -> Path:
    for suffix in SUFFIXES:
        if (folder / f"{name}{suffix}").is_file():
            return folder / f"{name}{suffix}"
    message = f"{one_line(str(folder))} must have an image of each bundle's name, got none for {name!r}; "
    raise FormatError(message + f"write {name}.png or {name}.npy there")
