"""CPU time of the marcher's kernels: `python -m tests.benchmarks.march [SIDE ...]`.

Smooth volumes (float32), a 256-knot table, 512 x 512 pixels, half-voxel steps, one thread.  Plain means that
every segment is sampled; planned, that what the scene does not need is left out.  Prints CPU seconds and
nanoseconds per nominal sample (of which a marcher without short cuts takes each), and the ratio to one
take-and-multiply per nominal sample in the same run: machines differ, the ratio less so.
"""

import dataclasses
import json
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

import volref as vr
from tests.benchmarks.stopwatch import cpu_seconds
from volref.phantoms.fields import gaussian_blobs
from volref.phantoms.transfer import smooth_curve_256
from volref.studies.precision.machine import this_machine

RESULTS = Path(__file__).parent / "results" / "march.json"
SIDES, PIXELS = (128, 256), 512


def bench_scene(side: int, pixels: int = PIXELS) -> vr.Scene:
    """The scene of the measurement, in voxel units."""
    made = gaussian_blobs(side)
    volume = vr.Volume(made.values.astype(np.float32), centering="node")
    transfer = smooth_curve_256(*volume.value_bounds, extinction=0.24 * 128 / side)
    center = volume.corners.mean(axis=0)
    eye = center + np.array([2.1, 1.4, 1.7]) * (side - 1) / 2 * 1.35
    camera = vr.Camera.look_at(eye, center, (0, 0, 1), 40, 0.1, 1e4)
    return vr.Scene(volume, transfer, camera, pixels, pixels)


def calibration(samples: int) -> float:
    """CPU seconds of one take and one multiply per sample, in pieces that stay in the cache."""
    table, index, out = np.random.default_rng(0).random(4096), np.arange(2**15) % 4096, np.empty(2**15)

    def work() -> None:
        for _ in range(max(samples // 2**15, 1)):
            np.take(table, index, out=out, mode="wrap")
            np.multiply(out, 1.5, out=out)

    return cpu_seconds(work)


def measure(sides: tuple[int, ...] = SIDES, pixels: int = PIXELS, repeats: int = 5) -> dict[str, Any]:
    """Return the figures, as JSON holds them."""
    rows = []
    for side in sides:
        scene = bench_scene(side, pixels)
        nominal = 0
        for precision in ("float32", "float64"):
            planned = vr.plan(scene, method="march", precision=precision)
            plain = dataclasses.replace(planned, occupancy=None, termination=0.0)
            for name, plan in (("plain", plain), ("planned", planned)):
                out = vr.render(scene, plan=plan, threads=1)
                nominal = nominal or out.samples
                seconds = cpu_seconds(
                    lambda scene=scene, plan=plan: vr.render(scene, plan=plan, threads=1), repeats
                )
                rows.append(
                    {
                        "side": side,
                        "precision": precision,
                        "name": name,
                        "seconds": seconds,
                        "nominal": nominal,
                        "taken": out.samples,
                        "ratio": seconds / calibration(nominal),
                    }
                )
    return {
        "format": "volref-march",
        "format_version": 1,
        "date": datetime.now(UTC).date().isoformat(),
        "machine": str(this_machine()),
        "pixels": pixels,
        "rows": rows,
    }


def march_section(figures: dict[str, Any]) -> str:
    """Return the figures as Markdown."""
    width = figures["pixels"]
    lines = [
        f"Smooth blobs in float32, a table of 256 knots, {width} x {width} pixels, steps of half a voxel,",
        "one thread. *Plain*: every segment sampled. *Planned*: empty space, early ends and what else the",
        "plan leaves out. A nominal sample is one that a plain march takes. The last column is the ratio to",
        "one `take` and one multiplication of a float64 per nominal sample, measured in between. The",
        "estimate of the error is in all of them.",
        "",
        "| volume | computed in | | CPU s | samples taken | ns each, nominal | ns each, taken | ratio |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in figures["rows"]:
        nominal, taken = row["seconds"] / row["nominal"] * 1e9, row["seconds"] / max(row["taken"], 1) * 1e9
        lines.append(
            f"| {row['side']}^3 | {row['precision']} | {row['name']} | {row['seconds']:.2f} "
            f"| {row['taken'] / 1e6:.1f} M of {row['nominal'] / 1e6:.1f} M | {nominal:.1f} | {taken:.1f} "
            f"| {row['ratio']:.0f} |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, print and write."""
    figures = measure(tuple(map(int, sys.argv[1:])) or SIDES)
    print(march_section(figures))
    RESULTS.parent.mkdir(parents=True, exist_ok=True)
    RESULTS.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
