"""Options of the image that people look at: tone mapping, for PNG only."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from volref.cli.options import fraction

if TYPE_CHECKING:
    from volref.arrays import Floats
    from volref.truth.result import Render


def add_display(parser: argparse.ArgumentParser) -> None:
    """Add --tone-map, --exposure and --gamma."""
    parser.add_argument(
        "--tone-map",
        type=operator_and_shape,
        metavar="NAME[:KEY=V,...]",
        help="map the light of a PNG: linear, exponential, reinhard, reinhard-extended:white=W, hable, or "
        "artistic:low=L,mid=M,high=H,saturation=S; .npy and .npz stay as they are",
    )
    parser.add_argument(
        "--exposure", type=fraction, metavar="E", help="multiply the light of a PNG by E before it is mapped"
    )
    parser.add_argument(
        "--gamma",
        type=fraction,
        metavar="G",
        help="encode a PNG as light^(1/G), as many shaders do with 2.2, and not as sRGB",
    )


def operator_and_shape(text: str) -> tuple[str, dict[str, float]]:
    """Return an operator and its parameters from a text such as hable:white=8.

    Raises
    ------
    argparse.ArgumentTypeError
        If a parameter is no KEY=NUMBER.

    Examples
    --------
    >>> operator_and_shape("reinhard"), operator_and_shape("artistic:low=0.1,high=2")
    (('reinhard', {}), ('artistic', {'low': 0.1, 'high': 2.0}))
    """
    name, _, rest = text.partition(":")
    shape = {}
    for part in filter(None, rest.split(",")):
        key, equals, value = part.partition("=")
        if not equals:
            message = f"must be NAME or NAME:KEY=NUMBER,... such as hable:white=8, got {text!r}"
            raise argparse.ArgumentTypeError(message)
        shape[key] = fraction(value)
    return name, shape


def check_display(options: argparse.Namespace) -> None:
    """Refuse display options that cannot be, before the work rather than after it."""
    import numpy as np

    shown(np.array([[[0.5, 0.5, 0.5, 1.0]]]), options)


def shown(rgba: "Floats", options: argparse.Namespace) -> tuple["Floats", str]:
    """Return what a PNG shows of an image, and its encoding."""
    if options.tone_map is None and options.exposure is None and options.gamma is None:
        return rgba, "srgb"
    from volref.tonemap import tone_map

    operator, shape = options.tone_map or ("linear", {})
    exposure = 1.0 if options.exposure is None else options.exposure
    gamma = 1.0 if options.gamma is None else options.gamma
    image = tone_map(rgba, operator, exposure=exposure, gamma=gamma, **shape)
    return image, "srgb" if options.gamma is None else "none"


def save(out: "Render", target: Path, options: argparse.Namespace) -> None:
    """Write an image: a PNG as the options have it, anything else as it is."""
    from volref.io.images import write_image

    if target.suffix.lower() != ".png":
        out.save(target, overwrite=options.force)
        return
    image, encoding = shown(out.rgba, options)
    write_image(target, image, encoding=encoding, overwrite=options.force)
