"""CPU time of the marcher: `python -m tests.benchmarks.march [SIDE]`.

A smooth 128^3 volume (float32), a 256-knot table, 512 x 512 pixels, half-voxel steps, float64, one thread.
Prints CPU seconds, nanoseconds per nominal sample (what a marcher without short cuts would take) and per
sample taken, the estimate, and the ratio to one take-and-multiply per nominal sample in the same run:
machines differ, the ratio less so.
"""

import sys
import time
from collections.abc import Callable

import numpy as np

import volref as vr
from volref.phantoms.fields import gaussian_blobs
from volref.phantoms.transfer import smooth_curve_256


def bench_scene(side: int) -> vr.Scene:
    """The scene of the measurement, in voxel units."""
    made = gaussian_blobs(side)
    volume = vr.Volume(made.values.astype(np.float32), centering="node")
    transfer = smooth_curve_256(*volume.value_bounds, extinction=0.24 * 128 / side)
    center = volume.corners.mean(axis=0)
    eye = center + np.array([2.1, 1.4, 1.7]) * (side - 1) / 2 * 1.35
    return vr.Scene(volume, transfer, vr.Camera.look_at(eye, center, (0, 0, 1), 40, 0.1, 1e4), 512, 512)


def cpu_seconds(work: Callable[[], object], repeats: int = 5) -> float:
    """Least CPU time of a few runs: the others were disturbed."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)


def calibration(samples: int) -> float:
    """CPU seconds of one take and one multiply per sample, in pieces that stay in the cache."""
    table, index, out = np.random.default_rng(0).random(4096), np.arange(2**15) % 4096, np.empty(2**15)

    def work() -> None:
        for _ in range(samples // 2**15):
            np.take(table, index, out=out, mode="wrap")
            np.multiply(out, 1.5, out=out)

    return cpu_seconds(work)


def main() -> None:
    """Measure and print."""
    scene = bench_scene(int(sys.argv[1]) if len(sys.argv) > 1 else 128)
    plan = vr.plan(scene, method="march")
    nominal = vr.render(scene, plan=plan.everything(), threads=1).samples
    unit = calibration(nominal)
    print(plan)
    print(f"nominal samples {nominal / 1e6:.1f} M; take and multiply {unit:.3f} s")
    for name, chosen in (("planned", plan), ("everything forced in", plan.everything())):
        out = vr.render(scene, plan=chosen, threads=1)
        seconds = cpu_seconds(lambda chosen=chosen: vr.render(scene, plan=chosen, threads=1))
        print(
            f"{name}: {seconds:.2f} s CPU, {seconds / nominal * 1e9:.1f} ns per nominal sample, "
            f"{seconds / out.samples * 1e9:.1f} ns per sample taken ({out.samples / nominal:.0%}), "
            f"estimate max {out.bound.max():.1e}, {seconds / unit:.1f} x take and multiply"
        )


if __name__ == "__main__":
    main()
