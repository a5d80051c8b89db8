"""Carry the echoes of a radar volume along: `python -m data_gen.moving RADAR OUT [--wind EAST NORTH]`.

Writes COUNT radar volumes, STEP seconds apart, as OUT/<name>_00.npz and so on: made-up motion of measured
echoes, for `volref render --series`.  Exit codes: 0 written, 2 refused, with one sentence on stderr.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from volref import FormatError, SceneError, load_radar, save_radar
from volref.arrays import whole_number
from volref.truth.radar.moving import moving


def write_moving(
    radar_file: str | Path,
    folder: str | Path,
    *,
    wind: Sequence[float] = (12.0, 8.0),
    step: float = 300.0,
    count: int = 9,
    force: bool = False,
) -> list[Path]:
    """Write `count` volumes of the echoes in `radar_file`, carried by `wind` (m/s), and return their files.

    Raises
    ------
    SceneError
        If a number is out of range.
    FormatError
        If the radar cannot be read, or a file exists and `force` is not given.
    """
    whole_number("count", count, low=1, high=1000)
    radar = load_radar(radar_file)
    out = Path(folder)
    out.mkdir(parents=True, exist_ok=True)
    files = [out / f"{Path(radar_file).stem}_{k:02d}.npz" for k in range(count)]
    for k, file in enumerate(files):
        (carried,) = moving(radar, [k * step], wind)
        save_radar(carried, file, overwrite=force)
    return files


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code."""
    parser = argparse.ArgumentParser(prog="python -m data_gen.moving", description=__doc__.splitlines()[0])
    parser.add_argument("radar", type=Path, metavar="RADAR", help="radar file, at time 0")
    parser.add_argument("out", type=Path, metavar="OUT", help="folder to write to")
    parser.add_argument(
        "--wind", type=float, nargs=2, default=(12.0, 8.0), metavar=("EAST", "NORTH"), help="m/s (12 8)"
    )
    parser.add_argument("--step", type=float, default=300.0, help="seconds from one to the next (300)")
    parser.add_argument("--count", type=int, default=9, help="how many volumes (9)")
    parser.add_argument("--force", action="store_true", help="overwrite files")
    options = parser.parse_args(arguments)
    try:
        files = write_moving(
            options.radar,
            options.out,
            wind=options.wind,
            step=options.step,
            count=options.count,
            force=options.force,
        )
    except (SceneError, FormatError) as error:
        print(f"data_gen: {error}", file=sys.stderr)
        return 2
    print(f"wrote {len(files)} volumes to {options.out}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
