"""Runs methods over scenes: errors against the certified reference, and the least CPU time of a few runs."""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from volref.arrays import number, whole_number
from volref.errors import SceneError
from volref.planning import more_than_values
from volref.scene.scene import Scene
from volref.studies.precision.machine import this_machine
from volref.studies.precision.methods import Answer, Method, chosen_methods, setting_words
from volref.studies.precision.points import Point, SceneStudy, errors_of, share_held
from volref.studies.precision.report import PrecisionReport
from volref.studies.precision.suites import Subject
from volref.truth.rendering import render
from volref.truth.result import Render

# Called now and then with (runs done or spared, runs at most).
Progress = Callable[[int, int], None]

# Seconds of one scene after which nothing is timed again, and runs of a setting at most.
BUDGET = 240.0
RUNS = 5

# A method whose image (its tables aside) took more than this share of the budget, and more than this many
# seconds, gets no finer setting.
LONGEST_SHARE, LONGEST_AT_LEAST = 0.1, 1.0

REFERENCE_TOLERANCE = 1e-12


def run_precision(
    subjects: Sequence[Subject],
    *,
    methods: Sequence[str] | None = None,
    budget: float = BUDGET,
    runs: int = RUNS,
    progress: Progress | None = None,
) -> PrecisionReport:
    """Measure error and time of the methods on the subjects.

    Everything runs on one thread, and seconds are CPU seconds, so other work on the machine counts only
    where it slows the processor down.

    Parameters
    ----------
    subjects
        Scenes with a volume.
    methods
        Names from `volref.studies.precision.METHODS`; default all.
    budget
        Seconds for each scene.  Every setting runs once, and as long as this lasts it runs again.  A method
        of which one image took a tenth of it, and over a second, gets no finer settings.
    runs
        How often a setting runs at most.
    progress
        Called with (runs done or spared, runs at most).

    Raises
    ------
    SceneError
        If a method is unknown, a scene has no volume, or the budget is not positive.

    Examples
    --------
    >>> from volref.studies.precision.suites import SUITES, subject_of
    >>> report = run_precision([subject_of(SUITES[1], (8, 6))], methods=["exact", "trapezoid"], runs=1)
    >>> [(study.name, study.methods, len(study.points)) for study in report.scenes]
    [('few-kinks', ('exact', 'trapezoid'), 19)]
    >>> report.passed
    True
    """
    number("budget", budget, above=0)
    wanted = chosen_methods(methods)
    for subject in subjects:
        if subject.scene.volume is None:
            message = f"scene {subject.name} must have a volume, got meshes only; "
            raise SceneError(message + "there is nothing to integrate")
        if more := more_than_values(subject.scene):
            message = f"scene {subject.name} must be one volume of values up to an opaque surface, got "
            raise SceneError(message + f"{more}; leave it out")
    whole_number("runs", runs, low=1, high=1000)
    started = time.perf_counter()
    most = runs * sum(len(method.ladder) for method in wanted)
    studies = []
    for i, subject in enumerate(subjects):

        def tell(done: int, before: int = i * most) -> None:
            if progress is not None:
                progress(before + done, len(subjects) * most)

        studies.append(study_scene(subject, wanted, budget, runs, tell))
        tell(most)
    return PrecisionReport(this_machine(), tuple(studies), budget, time.perf_counter() - started)


def study_scene(
    subject: Subject, methods: Sequence[Method], budget: float, runs: int, tell: Callable[[int], None]
) -> SceneStudy:
    """Measure `methods` on one scene; `tell` is called with the number of runs done or spared.

    Later rounds go through all settings again rather than through one setting after the other, so that a
    busy minute of the machine does not fall on one method.
    """
    scene = subject.scene
    assert scene.volume is not None
    deadline = time.perf_counter() + budget
    reference = render(scene, method="exact", tolerance=REFERENCE_TOLERANCE, threads=1)
    points: list[Point] = []
    stopped: list[str] = []
    for method in methods:
        for setting, finer in zip(method.ladder, _tails(method.ladder), strict=True):
            tell(len(points))
            points.append(_first_run(scene, method, setting, reference))
            image = points[-1].seconds - (points[-1].preparation or 0.0)
            if image > max(LONGEST_SHARE * budget, LONGEST_AT_LEAST) and finer:
                left_out = ", ".join(setting_words(method, s) for s in finer)
                took = f"{setting_words(method, setting)} took {image:.0f} s"
                stopped.append(f"{method.name} at {left_out}: {took}")
                break
    by_name = {method.name: method for method in methods}
    for done in range(len(points), runs * len(points)):
        tell(done)
        place = done % len(points)
        point = points[place]
        if time.perf_counter() + point.seconds < deadline:
            again = _timed(by_name[point.method], scene, point.setting)[0]
            points[place] = replace(point, seconds=min(point.seconds, again), runs=point.runs + 1)
    return SceneStudy(
        subject.name,
        subject.meaning,
        scene.width,
        scene.height,
        scene.gridded[0].size,
        float(reference.bound.max()),
        tuple(points),
        tuple(stopped),
    )


def _tails(ladder: tuple[float, ...]) -> list[tuple[float, ...]]:
    return [ladder[i + 1 :] for i in range(len(ladder))]


def _timed(method: Method, scene: Scene, setting: float) -> tuple[float, Answer]:
    started = time.process_time()
    answer = method.run(scene, setting)
    return time.process_time() - started, answer


def _first_run(scene: Scene, method: Method, setting: float, reference: Render) -> Point:
    seconds, answer = _timed(method, scene, setting)
    difference = np.abs(answer.rgba - reference.rgba).max(axis=-1)
    bound = answer.bound
    return Point(
        method=method.name,
        setting=setting,
        answered=answer.answered,
        errors=errors_of(difference, reference.bound),
        seconds=seconds,
        runs=1,
        preparation=answer.preparation,
        samples=answer.samples,
        bound_kind=answer.bound_kind,
        bound=None if bound is None else float(bound.max()),
        held=None if bound is None else share_held(difference, bound, reference.bound),
        tolerance=setting if method.knob == "tolerance" and bound is not None else None,
    )
