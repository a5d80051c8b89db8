"""Who works on an image: threads of this process, or whatever an executor stands for.

The image does not depend on it: each part is integrated by itself, and one thread puts the results in place.
"""

import os
import tempfile
import time
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from volref.arrays import Indices
from volref.errors import FormatError, SceneError
from volref.io.references import SHARED
from volref.scene.footprint import Rectangle
from volref.truth.canvas import Canvas
from volref.truth.errands import errand_of, forget, run_errand
from volref.truth.integration import Integrated, Integration
from volref.truth.parts import Parts, runs_in
from volref.truth.workers import results

# Called now and then with (tasks done, tasks in all).
Progress: TypeAlias = Callable[[int, int], None]

# What is sent to another process at a time: up to so many pixels, and fewer where the tasks would be few.
MOST_PIXELS, ENOUGH_TASKS = 1 << 14, 64

# Runs of a march for one thread of this process, of at least so many pixels.
RUNS_PER_THREAD, LEAST_RUN = 4, 1 << 10

Done: TypeAlias = Generator[tuple[int, Integrated | None], None, None]


class Crew:
    """Threads or an executor that fill in a canvas until a deadline; a context that leaves nothing behind."""

    def __init__(
        self, executor: Executor | None, threads: int, progress: Progress | None, deadline: float
    ) -> None:
        if executor is not None and not isinstance(executor, Executor):
            message = f"executor must be a concurrent.futures.Executor, got {type(executor).__name__}; "
            raise SceneError(message + "of a Dask Client pass client.get_executor()")
        self.threads, self.progress, self.deadline = threads, progress, deadline
        self._executor = executor
        self._seen: set[tuple[str, int, int]] = set()
        self._stack = ExitStack()
        self._made: Path | None = None

    def __enter__(self) -> "Crew":
        """Return the crew."""
        return self

    def __exit__(self, *_: object) -> None:
        """Remove what was written for workers."""
        self._stack.close()

    @property
    def size(self) -> int:
        """Threads that work; of an executor, those that were seen to."""
        return self.threads if self._executor is None else max(len(self._seen), 1)

    def runs(self, rectangle: Rectangle, width: int, longest: int) -> Parts:
        """Return the pixels of a rectangle in runs for a march, short enough for all to take part."""
        tasks = ENOUGH_TASKS if self._executor is not None else RUNS_PER_THREAD * self.threads
        length = longest if self.threads == 1 and self._executor is None else -(-rectangle.pixels // tasks)
        return runs_in(rectangle, width, min(longest, max(length, LEAST_RUN)))

    def draw(
        self,
        canvas: Canvas,
        integration: Integration,
        parts: Parts,
        tolerance: float = 0.0,
        *,
        only_better: bool = False,
    ) -> None:
        """Fill in `parts` until the deadline; what is not reached, or was known better, stays as it is."""
        inside = self._executor is None or isinstance(self._executor, ThreadPoolExecutor)
        tasks = parts.grouped(1 if inside else _parts_per_task(parts))
        begin = self._draw_here if inside else self._draw_elsewhere
        with closing(begin(canvas, integration, parts, tasks, tolerance)) as all_done:
            for count, (number, done) in enumerate(all_done, start=1):
                if done is not None:
                    pixels = _joined(parts, tasks[number])
                    canvas.put(pixels, done, only_better=only_better)
                    self._seen.add(done.worker)
                if self.progress is not None:
                    self.progress(count, len(tasks))

    def _draw_here(
        self, canvas: Canvas, integration: Integration, parts: Parts, tasks: list[range], tolerance: float
    ) -> Done:
        """Integrate in threads of this process."""
        integration.make_ready()

        def integrate(task: range) -> Integrated | None:
            if time.perf_counter() > self.deadline:
                return None
            return canvas.integrated(integration, _joined(parts, task), tolerance)

        items = ((task,) for task in tasks)
        if self._executor is not None:
            yield from results(self._executor, integrate, items)
            return
        with ThreadPoolExecutor(self.threads) as pool:
            yield from results(pool, integrate, items, ahead=2 * self.threads)

    def _draw_elsewhere(
        self, canvas: Canvas, integration: Integration, parts: Parts, tasks: list[range], tolerance: float
    ) -> Done:
        """Let an executor of other processes integrate."""
        assert self._executor is not None
        errand = errand_of(integration, self._folder)
        self._stack.callback(forget)  # if the executor breaks, this process runs errands itself

        def items() -> Iterator[tuple[Any, ...]]:
            for task in tasks:
                distance = behind = layers = None
                if canvas.surface is not None:
                    pixels = _joined(parts, task)
                    distance, behind = canvas.distance[pixels], canvas.behind(pixels)
                    layers = canvas.layers_of(pixels)
                yield errand, [parts.pixels(i) for i in task], distance, behind, layers, tolerance

        yield from results(self._executor, run_errand, items(), deadline=self.deadline, threads=self.threads)

    def _folder(self) -> Path:
        """Return the folder for what workers are to read, made when first asked for."""
        if self._made is None:
            shared = os.environ.get(SHARED)
            try:
                made = tempfile.TemporaryDirectory(prefix="volref-", dir=shared, ignore_cleanup_errors=True)
            except OSError as error:
                message = f"{SHARED} must name a folder that can be written to, got {shared}; "
                raise FormatError(message + "create it, or name another one") from error
            self._made = Path(self._stack.enter_context(made)).resolve()
        return self._made


def _parts_per_task(parts: Parts) -> int:
    if parts.count == 0:
        return 1
    each = len(parts.pixels(0))
    return max(1, min(MOST_PIXELS // each, parts.count // ENOUGH_TASKS))


def _joined(parts: Parts, task: range) -> Indices:
    return np.concatenate([parts.pixels(i) for i in task])


def available_cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
