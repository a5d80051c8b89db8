"""Write a volume that is larger than one wants to hold: `python -m data_gen.large OUT.npy [--side N]`.

A ball of shells in uint8, N^3 voxels of size 1 (default 1024: 1 GiB), written a layer at a time.  With r the
distance from the centre of the box over half its side,

    value = round(127.5 (1 + cos(2 pi r / PERIOD)))  for r < RADIUS, else 0

so that 62 % of the voxels are 0.  Layers of zeros are not written: where the file system knows holes, they
take no room.  Exit codes: 0 written, 2 refused, with one sentence on stderr.
"""

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from volref.arrays import Bytes, Integers, whole_number
from volref.errors import FormatError, SceneError
from volref.io import atomic_path

RADIUS, PERIOD = 0.9, 0.15


def large_layers(side: int) -> Iterator[Bytes | None]:
    """Yield the layers (side, side) of the volume from z = 0 on, None for those that are 0 throughout.

    Examples
    --------
    >>> [layer is None for layer in large_layers(20)].count(True), list(large_layers(4))[1][1].tolist()
    (2, [2, 224, 224, 2])
    """
    half = np.arange(1, side, 2, dtype=np.int64)  # voxel centres from the middle on, in half voxels
    squares = half**2
    across = squares[:, None] + squares
    values = _values_by_square(side)
    for z in [*range(side // 2)[::-1], *range(side // 2)]:
        if half[z] >= RADIUS * side:
            yield None
            continue
        quarter = values.take(across + squares[z], mode="clip")
        lower = np.concatenate([quarter[:, ::-1], quarter], axis=1)
        yield np.concatenate([lower[::-1], lower])


def write_large(
    path: str | Path,
    side: int = 1024,
    *,
    force: bool = False,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Write the volume to a .npy file, whole or not at all; `progress` is told the part that is done.

    Raises
    ------
    SceneError
        If `side` is odd, below 2 or above 4096.
    FormatError
        If the file exists and `force` is not given, or cannot be written.
    """
    whole_number("side", side, low=2, high=4096)
    if side % 2:
        message = f"side must be even, got {side}; give {side + 1}"
        raise SceneError(message)
    with atomic_path(path, overwrite=force) as temporary, temporary.open("wb") as stream:
        np.lib.format.write_array_header_1_0(
            stream, {"descr": "|u1", "fortran_order": False, "shape": (side, side, side)}
        )
        start = stream.tell()
        for z, layer in enumerate(large_layers(side)):
            if layer is not None:
                stream.seek(start + z * side * side)
                stream.write(layer.data)
            if progress is not None:
                progress((z + 1) / side)
        stream.truncate(start + side**3)


def _values_by_square(side: int) -> Bytes:
    """Return the value at each squared distance from the centre, in half voxels; the last one is 0."""
    squares: Integers = np.arange(int((RADIUS * side) ** 2) + 2)
    radius = np.sqrt(squares) / side
    values = np.rint(127.5 * (1 + np.cos(2 * np.pi * radius / PERIOD)))
    values[(radius >= RADIUS) | (squares == squares[-1])] = 0
    return values.astype(np.uint8)


def _show(part: float) -> None:
    print(f"\r{part:4.0%}", end="" if part < 1 else "\n", file=sys.stderr, flush=True)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    parser = argparse.ArgumentParser(prog="data_gen.large", description="Write a large made-up volume.")
    parser.add_argument("out", type=Path, metavar="OUT.npy", help="the file to write")
    parser.add_argument("--side", type=int, default=1024, help="voxels a side, even (default 1024)")
    parser.add_argument("--force", action="store_true", help="replace a file that exists")
    options = parser.parse_args(arguments)
    try:
        progress = _show if sys.stderr.isatty() else None
        write_large(options.out, options.side, force=options.force, progress=progress)
    except (FormatError, SceneError) as error:
        print(f"data_gen.large: {error}", file=sys.stderr)
        return 2
    print(options.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
