"""The comparison: every renderer on every problem, each pair in a process of its own, one after the other."""

import datetime
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import volref as vr
from tests.benchmarks.peers.measure import SLOW
from tests.benchmarks.peers.problems import Problem, problem_of
from tests.benchmarks.peers.renderers import RENDERERS, Renderer
from tests.benchmarks.peers.truth import truth_of
from volref.studies.precision.machine import this_machine

FORMAT, FORMAT_VERSION = "volref-peers", 1
ROOT = Path(__file__).parents[3]
MODULE = "tests.benchmarks.peers.measure"

PROBLEMS = ("blobs128", "dense128", "ml128", "blobs128+mesh20k", "chest-ct")

# One thread for everything that would start more.
ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", "LP_NUM_THREADS"), "1"
)

# A process that has not ended by then is taken to hang.
TIMEOUT = 900.0

Say = Callable[[str], None]


def compare(
    problems: Sequence[str],
    renderers: Sequence[str],
    *,
    side: int = 512,
    max_seconds: float = 8.0,
    core: int | None = None,
    say: Say = lambda _: None,
) -> dict[str, Any]:
    """Return the figures as plain data; what could not be measured is in "absent", with the reason."""
    found: dict[str, list[dict[str, Any]]] = {"problems": [], "runs": [], "absent": []}
    chosen = [RENDERERS[name] for name in renderers]
    for renderer in chosen:
        if renderer.missing:
            why = f"not installed: {', '.join(renderer.missing)}"
            found["absent"].append({"renderer": renderer.name, "problem": None, "why": why})
            say(f"{renderer.title}: {why}")
    chosen = [renderer for renderer in chosen if not renderer.missing]
    options = {"side": side, "max_seconds": max_seconds, "core": _first_core() if core is None else core}
    for name in problems:
        _compare_on(problem_of(name, side), chosen, options, found, say)
    versions = {name: which for renderer in chosen for name, which in renderer.versions.items()}
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "machine": str(this_machine()),
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "packages": {"volref": vr.__version__, **dict(sorted(versions.items()))},
        "slow": SLOW,
        **options,
        **found,
    }


def _first_core() -> int:
    return min(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 0


def _compare_on(
    problem: Problem,
    renderers: Sequence[Renderer],
    options: dict[str, Any],
    found: dict[str, list[dict[str, Any]]],
    say: Say,
) -> None:
    """Add a problem's runs to what was `found`."""
    truth = truth_of(problem)
    found["problems"].append(
        {
            "name": problem.name,
            "width": problem.width,
            "height": problem.height,
            "volume": [int(count) for count in problem.size],
            "triangles": 0 if problem.mesh is None else len(problem.mesh.faces),
            "samples": problem.samples(1.0),
            "judged": len(problem.judged),
            "truth_bound": float(truth.bound.max()),
        }
    )
    say(f"{problem.name}: {len(problem.judged)} pixels certified to {truth.bound.max():.1e}")
    with tempfile.TemporaryDirectory() as folder:
        np.save(Path(folder) / "truth.npy", truth.rgba)
        for renderer in renderers:
            if problem.mesh is not None and not renderer.meshes:
                run: dict[str, Any] | str = "draws no meshes"
            else:
                run = _in_process(Path(folder), renderer.name, problem.name, options)
            if isinstance(run, str):
                found["absent"].append({"renderer": renderer.name, "problem": problem.name, "why": run})
                say(f"  {renderer.title}: {run}")
            else:
                found["runs"].append(run)
                say(f"  {renderer.title}{run['remark'] and ': ' + run['remark']}")
                for point in run["points"]:
                    say("    " + _point_words(renderer, point))


def _in_process(folder: Path, renderer: str, problem: str, options: dict[str, Any]) -> dict[str, Any] | str:
    """Return a run, or why there is none."""
    job = {"renderer": renderer, "problem": problem, "truth": str(folder / "truth.npy"), **options}
    file = folder / "job.json"
    file.write_text(json.dumps(job), encoding="utf-8")
    environment = os.environ | ONE_THREAD
    environment.pop("DISPLAY", None)
    try:
        done = subprocess.run(
            [sys.executable, "-m", MODULE, str(file)],
            cwd=ROOT, env=environment, capture_output=True, text=True, timeout=TIMEOUT, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return f"not done after {TIMEOUT:.0f} s"
    if done.returncode != 0:
        last = done.stderr.strip().splitlines()[-1:] or [f"exit status {done.returncode}"]
        return f"failed: {last[0]}"
    run: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return run


def _point_words(renderer: Renderer, point: dict[str, Any]) -> str:
    return (
        f"{renderer.knob} {point['setting']:<8g} {point['seconds']:8.3f} s  "
        f"RMS {point['rms']:.1e}  largest {point['largest']:.1e}"
    )
