"""Arguments that several verbs share, and the words they take."""

import argparse
import json
import math
from typing import TYPE_CHECKING, Any

from volref.errors import FormatError

if TYPE_CHECKING:
    from volref.scene import Scene


# Those of volref.planning, which would be dear to import for a help text.
METHODS = ("auto", "march", "exact")


def fraction(text: str) -> float:
    """Return the number that `text` says, such as 0.002 or 1/510.

    Raises
    ------
    argparse.ArgumentTypeError
        If it says none.

    Examples
    --------
    >>> fraction("1/4"), fraction("2e-3")
    (0.25, 0.002)
    """
    above, slash, below = text.partition("/")
    try:
        value = float(above) / float(below if slash else 1)
    except (ValueError, ZeroDivisionError):
        value = math.nan
    if math.isfinite(value):
        return value
    message = f"must be a number such as 0.002 or 1/510, got {text!r}"
    raise argparse.ArgumentTypeError(message)


def image_size(text: str) -> tuple[int, int]:
    """Return (width, height) of a text such as 640x480.

    Raises
    ------
    argparse.ArgumentTypeError
        If it is none.

    Examples
    --------
    >>> image_size("640x480")
    (640, 480)
    """
    width, _, height = text.lower().partition("x")
    if not (width.isdecimal() and height.isdecimal()):
        message = f"must be WIDTHxHEIGHT in pixels such as 640x480, got {text!r}"
        raise argparse.ArgumentTypeError(message)
    return int(width), int(height)


def statement(text: str) -> tuple[str, Any]:
    """Return (key, value) of a text KEY=VALUE; the value is a number, a list of them, or a word.

    Raises
    ------
    argparse.ArgumentTypeError
        If it has no key.

    Examples
    --------
    >>> statement("skip=16"), statement("spacing=1,1,2.5"), statement("dtype=uint8")
    (('skip', 16), ('spacing', [1, 1, 2.5]), ('dtype', 'uint8'))
    """
    key, equals, value = text.partition("=")
    if not key or not equals:
        message = f"must be KEY=VALUE such as spacing=1,1,2, got {text!r}"
        raise argparse.ArgumentTypeError(message)
    for attempt in (value, f"[{value}]"):
        try:
            return key, json.loads(attempt, parse_constant=_word)
        except ValueError:
            continue
    return key, value


def nan_policy(text: str) -> str | float:
    """Return "refuse", or the number that replaces NaN.

    Raises
    ------
    argparse.ArgumentTypeError
        If it is neither.
    """
    if text == "refuse":
        return text
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if math.isfinite(value):
        return value
    message = f"must be 'refuse' or the number to put in place of NaN, got {text!r}"
    raise argparse.ArgumentTypeError(message)


def byte_count(text: str) -> int:
    """Return a number of bytes; K, M, G and T after it stand for 2^10, 2^20, 2^30 and 2^40.

    Raises
    ------
    argparse.ArgumentTypeError
        If it is none.

    Examples
    --------
    >>> byte_count("2G") == 2 * 2**30
    True
    """
    digits = text.rstrip("kKmMgGtT")
    unit = text[len(digits) :].upper()
    if not digits.isdecimal() or len(unit) > 1:
        message = f"must be a number of bytes such as 500M or 4G, got {text!r}"
        raise argparse.ArgumentTypeError(message)
    return int(digits) << 10 * (" KMGT".index(unit) if unit else 0)


def add_scene(parser: argparse.ArgumentParser, about: str = "a scene file (.json)") -> None:
    """Add SCENE, `about` being what it may be, and how to read it."""
    parser.add_argument("scene", metavar="SCENE", help=about)
    parser.add_argument(
        "--size",
        type=image_size,
        metavar="WxH",
        help="image size instead of the scene's; a camera given as a projection matrix keeps its aspect",
    )
    add_limit(parser)
    parser.add_argument(
        "--allow-outside",
        action="store_true",
        help="let the scene name files outside its own folder; only for scenes that you trust",
    )


def add_limit(parser: argparse.ArgumentParser) -> None:
    """Add --max-bytes."""
    parser.add_argument(
        "--max-bytes",
        type=byte_count,
        metavar="N",
        help="the most memory for one file, e.g. 32G; default 16G",
    )


def add_accuracy(parser: argparse.ArgumentParser) -> None:
    """Add --tolerance, --allow-estimate, --method and --step."""
    parser.add_argument(
        "--tolerance",
        type=fraction,
        metavar="E",
        help="error per pixel to stay below, e.g. 1/1000; default 1/510, half a level of an 8-bit image",
    )
    parser.add_argument(
        "--allow-estimate",
        action="store_true",
        help="let 'auto' answer with an estimated error where that is cheaper; by default the error is "
        "certified: proven, for every pixel",
    )
    parser.add_argument(
        "--method",
        choices=METHODS,
        default="auto",
        help="'exact' has a certified error; 'march', a uniform step, an estimated one; 'auto', the default, "
        "takes the cheapest that meets the tolerance",
    )
    parser.add_argument(
        "--step",
        type=fraction,
        metavar="L",
        help="march with segments of this length in world units; default half the least voxel spacing",
    )


def add_work(parser: argparse.ArgumentParser) -> None:
    """Add --threads and --quiet."""
    parser.add_argument(
        "-j", "--threads", type=int, metavar="N", help="threads; default every core.  The image is the same"
    )
    parser.add_argument("-q", "--quiet", action="store_true", help="no progress and no summary, errors only")


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add --json."""
    parser.add_argument("--json", action="store_true", help="machine output: one JSON document on stdout")


def add_force(parser: argparse.ArgumentParser) -> None:
    """Add --force."""
    parser.add_argument("-f", "--force", action="store_true", help="write over files that exist")


def add_statements(parser: argparse.ArgumentParser, what: str) -> None:
    """Add -D KEY=VALUE, which tells what a volume file does not say."""
    parser.add_argument(
        "-D",
        dest="statements",
        type=statement,
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help=f"tell what {what} does not say: spacing, origin, direction, centering; for RAW also size, "
        "dtype, byte_order, skip; key for .npz, .h5, .zarr, .bvp and DICOM; level, index for OME-Zarr; for a "
        "PNG slice atlas tiles_across, tiles_down, slices",
    )


def read_limit(options: argparse.Namespace) -> dict[str, Any]:
    """Return the keyword argument that --max-bytes stands for."""
    return {} if options.max_bytes is None else {"max_bytes": options.max_bytes}


def read_statements(options: argparse.Namespace) -> dict[str, Any]:
    """Return the keyword arguments that the -D options stand for.

    Raises
    ------
    FormatError
        If a key is none that a reader knows.
    """
    from volref.io.guard import nearest
    from volref.io.placement import GEOMETRY
    from volref.io.readers import READERS

    known = {*GEOMETRY, *(key for reader in READERS.values() for key in reader.keys)}
    for key, _ in options.statements:
        if key not in known:
            message = f"-D must name something that a volume reader knows, got {key!r}; {nearest(key, known)}"
            raise FormatError(message)
    return dict(options.statements)


def accuracy(options: argparse.Namespace) -> dict[str, Any]:
    """Return the keyword arguments that the options of `add_accuracy` stand for; --step asks for a march."""
    marching = options.method == "auto" and options.step is not None
    given = {"step": options.step, "tolerance": options.tolerance}
    return {
        "method": "march" if marching else options.method,
        "certified": not options.allow_estimate,
        **{name: value for name, value in given.items() if value is not None},
    }


def read_scene(options: argparse.Namespace) -> "Scene":
    """Return the scene that the options name, at the size they ask for."""
    import dataclasses

    from volref.io import load_scene

    scene = load_scene(options.scene, allow_outside=options.allow_outside, **read_limit(options))
    if options.size is None:
        return scene
    return dataclasses.replace(scene, width=options.size[0], height=options.size[1])


def _word(text: str) -> float:
    message = f"{text} is no JSON number"
    raise ValueError(message)
