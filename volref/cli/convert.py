"""`volref convert`: a volume from one file format to another."""

import argparse

from volref.cli.options import add_force, add_limit, add_statements, nan_policy, read_limit, read_statements
from volref.cli.output import note
from volref.cli.verb import GOOD, Verb


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "source",
        metavar="SRC",
        help="a volume: .npy .npz .nrrd .nhdr .nii .nii.gz .mha .mhd .dcm (or a folder) .tif .h5 .zarr "
        ".zarr.zip .bvp .raw .bin .png",
    )
    parser.add_argument(
        "target", metavar="DST", help="file to write: .npy .npz .nrrd .nii .nii.gz .mha .h5 .raw .png"
    )
    add_statements(parser, "SRC")
    parser.add_argument(
        "--nan",
        type=nan_policy,
        metavar="VALUE",
        default="refuse",
        help="'refuse' (default), or the number to put in place of NaN",
    )
    add_limit(parser)
    add_force(parser)
    parser.add_argument("-q", "--quiet", action="store_true", help="errors only")


def _run(options: argparse.Namespace) -> int:
    from volref.io import convert_volume

    convert_volume(
        options.source,
        options.target,
        overwrite=options.force,
        nan=options.nan,
        **read_limit(options),
        **read_statements(options),
    )
    if not options.quiet:
        note(f"wrote {options.target}")
    return GOOD


VERB = Verb(
    "convert",
    "a volume from one file format to another, values unchanged",
    (
        ("convert head.nii.gz head.nrrd", "the suffixes say the formats"),
        ("convert head.nrrd atlas.png", "a slice atlas for a WebGL 1 program (8-bit values)"),
        (
            "convert head.raw head.nrrd -D size=256,256,128 -D dtype=int16 -D byte_order=little -D skip=0 "
            "-D spacing=0.5,0.5,1",
            "a file without a header, which has to be described",
        ),
    ),
    _arguments,
    _run,
)
