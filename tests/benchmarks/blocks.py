"""CPU time of the ranges of blocks: `python -m tests.benchmarks.blocks [LARGEST_SIDE]`.

Prints for several sizes, up to 512 voxels a side unless told otherwise, the CPU seconds of one pass over the
voxels and its ratio to a plain read of them in the same run, `values.min()` and `values.max()`; the seconds
of asking again, which looks at no voxel; and how much memory the pass took, its result included.
"""

import sys
import tracemalloc

import numpy as np

from tests.benchmarks.stopwatch import cpu_seconds
from volref.scene.blocks import block_ranges, flag_blocks
from volref.scene.volume import Volume

SIZES = ((64, np.float64), (128, np.float32), (256, np.float32), (512, np.uint8), (1024, np.uint8))

# Blocks and reaches as the integrators ask for them; 4 and 2 is a march with the default step.
ASKED = ((4, 0), (4, 2), (8, 4))


def measure(values: np.ndarray, block: int, reach: int) -> tuple[float, float, float]:
    """Return the seconds of the first time and of the second, and MiB of memory."""

    def ask(volume: Volume) -> object:
        return flag_blocks(volume, block, (reach, reach, reach), lambda low, high: high > low)

    # A new volume each time: its ranges are kept as long as it lives.
    first = cpu_seconds(lambda: ask(Volume(values)))
    volume = Volume(values)
    tracemalloc.start()
    ask(volume)
    memory = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    block_ranges(volume, block, (reach, reach, reach))
    return first, cpu_seconds(lambda: ask(volume)), memory / 2**20


def main() -> None:
    """Print the table."""
    largest = int(sys.argv[1]) if len(sys.argv) > 1 else 512
    print("voxels            plain read s  block reach   pass s  ratio  again s  MiB")
    for side, dtype in SIZES:
        if side > largest:
            continue
        values = np.random.default_rng(0).integers(0, 255, (side, side, side), np.uint8).astype(dtype)
        plain = cpu_seconds(lambda values=values: (values.min(), values.max()), 9)
        for block, reach in ASKED:
            first, again, memory = measure(values, block, reach)
            print(
                f"{side:5d}^3 {np.dtype(dtype).name:7s}  {plain:12.4f}  {block:5d} {reach:5d}"
                f"  {first:7.4f}  {first / plain:5.1f}  {again:7.4f}  {memory:5.1f}"
            )


if __name__ == "__main__":
    main()
