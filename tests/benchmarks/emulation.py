"""What a sample of an emulation costs beside one of the marcher: `python -m tests.benchmarks.emulation`.

All in one run, alternated, CPU time on one thread: the least of some repeats, and its ratio to the marcher's.
"""

import sys

import numpy as np

import volref as vr
from tests.benchmarks.stopwatch import cpu_seconds
from volref.emulation.drawing import prepare
from volref.emulation.loop.marching import march

REPEATS = 5


def noise(side=64, pixels=320):
    """A cube of noise seen obliquely, so faint that no ray ends early."""
    random = np.random.default_rng(0)
    volume = vr.Volume((random.random((side, side, side)) * 255).astype(np.uint8))
    opacity = np.append(0.0, random.random(8) * 0.02)
    transfer = vr.TransferFunction.from_opacity(np.linspace(0, 255, 9), random.random((9, 3)), opacity)
    camera = vr.Camera.look_at((1.9 * side, 1.4 * side, -1.25 * side), (side / 2,) * 3, (0, 1, 0), 40, 1, 400)
    return vr.Scene(volume, transfer, camera, pixels, pixels)


def nanoseconds(names):
    """Least CPU time per sample of the plain marcher and of the loops of pipelines, in ns."""
    scene = noise()
    plan = vr.plan(scene, method="march", step=0.5)
    start = np.zeros(scene.width * scene.height)
    loops = {name: prepare(scene, vr.pipelines()[name], vr.Device()).program(start) for name in names}
    works = {"plain march": lambda: vr.render(scene, plan=plan, threads=1).samples}
    works |= {name: lambda loop=loop: march(loop).samples.sum() for name, loop in loops.items()}
    counts = {name: int(work()) for name, work in works.items()}
    best = dict.fromkeys(works, np.inf)
    for _ in range(REPEATS):
        for name, work in works.items():
            best[name] = min(best[name], cpu_seconds(work, 1))
    return {name: 1e9 * best[name] / counts[name] for name in works}


if __name__ == "__main__":
    drawn = [name for name in vr.pipelines() if "radar" not in name]
    found = nanoseconds(sys.argv[1:] or drawn)
    for name, each in found.items():
        print(f"{name:<22} {each:6.0f} ns   {each / found['plain march']:5.2f}")
