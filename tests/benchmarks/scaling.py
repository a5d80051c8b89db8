"""How the cost grows, and what threads give: `python -m tests.benchmarks.scaling`.

CPU seconds of one thread, but for the last part, which is wall time: one thread, two threads, and two
processes that render the same at the same time, in turns, so that what else the machine does hits all alike.
"""

import json
import math
import statistics
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from datetime import UTC, datetime
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Any

import volref as vr
from tests.benchmarks.march import bench_scene
from tests.benchmarks.stopwatch import cpu_seconds
from tests.oracles.meshes import bumpy_sphere
from volref.io.atomic import atomic_path
from volref.report.plots import check_matplotlib
from volref.studies.precision.machine import this_machine

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RESULTS = Path(__file__).parent / "results" / "scaling.json"
PIXELS, STEPS, SIDES, TRIANGLES = (
    (128, 256, 512, 1024),
    (2.0, 1.0, 0.5, 0.25),
    (64, 128, 256),
    (1e3, 2e4, 3e5),
)
ROUNDS = 5

Point = dict[str, float]


def march_seconds(scene: vr.Scene, step: float = 0.5, *, repeats: int = 3) -> float:
    """CPU seconds of a march as planned, in one thread; the plan is made before."""
    plan = vr.plan(scene, method="march", step=step)
    vr.render(scene, plan=plan, threads=1)
    return cpu_seconds(lambda: vr.render(scene, plan=plan, threads=1), repeats)


def mesh_seconds(triangles: float, pixels: int) -> float:
    """CPU seconds of an image of a mesh alone."""
    camera = vr.Camera.look_at((2.4, 1.7, 1.6), (0, 0, 0), (0, 0, 1), 40.0, 0.1, 100.0)
    scene = vr.Scene(None, None, camera, pixels, pixels, meshes=[bumpy_sphere(int(triangles))])
    return cpu_seconds(lambda: vr.render(scene, threads=1), 3)


def _render_once(side: int, pixels: int, threads: int, start: float = 0.0) -> float:
    """Wall seconds of a march and of an exact image; a process begins at the time `start`."""
    scene = bench_scene(side, pixels)
    plans = [vr.plan(scene, method=method) for method in ("march", "exact")]
    vr.render(scene, plan=plans[0], threads=threads)
    time.sleep(max(start - time.time(), 0.0))
    begun = time.perf_counter()
    for plan in plans:
        vr.render(scene, plan=plan, threads=threads)
    return time.perf_counter() - begun


def threads_seconds(side: int, pixels: int, rounds: int) -> dict[str, float]:
    """Median wall seconds of one thread, of two, and of two processes at once, for one image each."""
    found: dict[str, list[float]] = {"one thread": [], "two threads": [], "two processes": []}
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        for _ in range(rounds):
            found["one thread"].append(_render_once(side, pixels, 1))
            found["two threads"].append(_render_once(side, pixels, 2))
            start = time.time() + 4.0
            both = [pool.submit(_render_once, side, pixels, 1, start) for _ in range(2)]
            # Two images in the time of the slower.
            found["two processes"].append(max(each.result() for each in both) / 2)
    return {name: statistics.median(seconds) for name, seconds in found.items()}


def measure(
    pixels: tuple[int, ...] = PIXELS,
    steps: tuple[float, ...] = STEPS,
    sides: tuple[int, ...] = SIDES,
    triangles: tuple[float, ...] = TRIANGLES,
    *,
    side: int = 128,
    width: int = 512,
    rounds: int = ROUNDS,
) -> dict[str, Any]:
    """Return the figures, as JSON holds them."""
    scene = bench_scene(side, width)
    return {
        "format": "volref-scaling",
        "format_version": 1,
        "date": datetime.now(UTC).date().isoformat(),
        "machine": str(this_machine()),
        "side": side,
        "width": width,
        "pixels": [{"x": n * n, "seconds": march_seconds(bench_scene(side, n))} for n in pixels],
        "steps": [{"x": 1 / step, "seconds": march_seconds(scene, step)} for step in steps],
        "volume": [{"x": n**3, "seconds": march_seconds(bench_scene(n, width))} for n in sides],
        "triangles": [{"x": n, "seconds": mesh_seconds(n, width)} for n in triangles],
        "threads": threads_seconds(side, width, rounds),
    }


TITLES = {
    "pixels": "pixels",
    "steps": "segments per voxel",
    "volume": "voxels (steps of half a voxel)",
    "triangles": "triangles of a mesh alone",
}


def slope(points: list[Point]) -> float:
    """Return the exponent p of seconds ~ x^p between the two largest x."""
    first, last = points[-2], points[-1]
    return math.log(last["seconds"] / first["seconds"]) / math.log(last["x"] / first["x"])


def scaling_section(figures: dict[str, Any]) -> str:
    """Return the figures as Markdown."""
    side, width = figures["side"], figures["width"]
    lines = [
        f"A march of blobs of {side}^3 voxels at {width} x {width} pixels and half a voxel, as planned, but",
        "for what is varied. The exponent is that between the two largest: 1 is proportional.",
        "",
        "| with | CPU s | exponent |",
        "| --- | --- | --- |",
    ]
    for name, title in TITLES.items():
        points = figures[name]
        seconds = ", ".join(f"{point['x']:.3g}: {point['seconds']:.2f}" for point in points)
        lines.append(f"| {title} | {seconds} | {slope(points):.2f} |")
    threads = figures["threads"]
    one, two, both = (threads[name] for name in ("one thread", "two threads", "two processes"))
    lines += [
        "",
        f"A march and an exact image one after the other take {one:.2f} s of wall time with one thread, and",
        f"{two:.2f} s with two, {one / two:.2f} times as fast. Two processes at once take {both:.2f} s",
        f"an image, so threads reach {both / two:.2f} of what independent processes do.",
    ]
    return "\n".join(lines) + "\n"


def save_plot(figures: dict[str, Any], path: Path) -> None:
    """Write the plot, as .svg or .png by the suffix."""
    check_matplotlib()
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context({"font.family": "DejaVu Sans", "font.size": 9, "svg.hashsalt": "volref"}):
        figure = Figure(figsize=(11.0, 3.0), dpi=150, facecolor="white", layout="constrained")
        draw(figures, figure)
        metadata: dict[str, Any] = {"Date": None} if path.suffix == ".svg" else {}
        with atomic_path(path, overwrite=True) as temporary:
            figure.savefig(temporary, metadata=metadata)


def draw(figures: dict[str, Any], figure: "Figure") -> None:
    """Draw a panel for each of the four, with a line of slope 1."""
    from matplotlib.ticker import NullFormatter

    panels = figure.subplots(1, len(TITLES), sharey=True)
    for axes, (name, title) in zip(panels, TITLES.items(), strict=True):
        points = figures[name]
        x, seconds = [point["x"] for point in points], [point["seconds"] for point in points]
        axes.loglog(x, seconds, "o-", color="#1F4E79", label="measured")
        axes.loglog(x, [seconds[-1] * at / x[-1] for at in x], "--", color="#8A8A8A", label="proportional")
        axes.set_xlabel(title)
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.grid(visible=True, which="both", alpha=0.25)
    panels[0].set_ylabel("CPU seconds, one thread")
    panels[0].legend()


def main() -> None:
    """Measure, print and write."""
    figures = measure()
    sys.stdout.write(scaling_section(figures))
    RESULTS.parent.mkdir(parents=True, exist_ok=True)
    RESULTS.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
