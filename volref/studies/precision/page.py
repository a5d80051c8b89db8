"""The precision study as a page: what to use, what certainty costs, and the numbers scene by scene."""

from collections.abc import Iterable, Mapping, Sequence

from volref.planning import HALF_LEVEL
from volref.studies.precision.frontier import fastest
from volref.studies.precision.machine import Machine
from volref.studies.precision.methods import METHODS, Method, power_words, setting_words
from volref.studies.precision.points import Point, SceneStudy

# Errors that a reader may be after: a visible one, half a grey level, and on to what float64 can hold.
TARGETS = (1e-2, HALF_LEVEL, 1e-3, 1e-4, 1e-6, 1e-9, 1e-12)

COMMAND = (
    "volref precision --all tests/data/real_ct.json --markdown docs/precision.md "
    "--plot docs/images/precision.svg --force"
)

INTRODUCTION = """\
# Precision

How far from the truth each method is, and how long it takes to be so near. volref's own methods and the
integrators that GPUs and papers use render the same small scenes over their ladders of steps or
tolerances. The truth is the certified integral at 1e-12; the bound that it proves for itself is stated
with each scene, and an error that is not larger than it is shown as "at most".

This page and its plots are written by

```console
$ {command}
```

and a test holds that its scenes and methods are those of the code. `volref precision SCENE.json`
measures a scene of yours, `--csv` has every number, and the exit status is 1 if a certificate does not
hold.

The error of a pixel is the largest over its four channels, where 1 is white and half a grey level of an
8-bit image is 1/510. **Largest** is over all pixels. Seconds are CPU seconds on one thread from scene to
image, the least of up to {runs} runs, with all that a method has to prepare. The images are small, so
what is prepared once counts for more than it would in a large one: most of all the tables of
pre-integration, which a renderer may keep as long as the transfer function and the step stay.

Measured on: {machine}.

{sentence}.

## Which method to use

- **To know the error, in every pixel**: `render(scene, tolerance=...)`, which is certified. It needs no
  setting, and what it says of its error is proven.
- **To know it in most pixels**: `certified=False`. It is worth it where it is faster, and nothing is
  promised about the single pixel.
- **To look at a scene**: the marcher at half a voxel. Its error is not known before, and no step is safe
  for a table with spikes.
- **To judge a GPU**: none of the rivals. Their errors below are known because the truth stands beside
  them. On another scene, another view or another table the same setting has another error, and they do
  not say which.

## What certainty costs

The time of certified `auto` at a tolerance, over that of the fastest rival (the marcher among them)
whose largest error turned out to be within it: **above 1 volref loses**, and would have lost only to
someone who knew the setting beforehand. A dash: no rival got there at any setting that was tried.
"""

READING = """\
Below, for every method the seconds of its fastest setting that reaches an error in all pixels. Methods
that were asked for a tolerance must also have met it by their own bound, the others are taken by
hindsight. The fastest of each column is bold, a dash means that no setting got there, and the last
column is the least error that was reached. In the plots each line is a family of methods, rings mark
what no other method beats, and hollow marks are errors that are only known to be at most so large.

Front samples, of first order by themselves, do as well as middle ones where the volume is clear at its
border: over a whole ray they add up to the trapezoid rule.
"""


def precision_page(
    machine: Machine, scenes: Sequence[SceneStudy], sentence: str, images: Mapping[str, str]
) -> str:
    """Return the page; `images` are paths of plots by name of the scene."""
    runs = max((point.runs for study in scenes for point in study.points), default=1)
    parts = [
        INTRODUCTION.format(command=COMMAND, machine=machine, sentence=sentence, runs=runs),
        cost_table(scenes),
        "\n".join(_losses(scenes)),
        "## What each method reaches\n",
        READING,
    ]
    for study in scenes:
        parts += _section(study, images.get(study.name))
    return "\n".join(parts)


def cost_table(scenes: Iterable[SceneStudy]) -> str:
    """Return the table of what certainty costs: a row per scene, a column per error."""
    lines = _head("scene", TARGETS)
    for study in scenes:
        ratios = [_ratio(study, target) for target in TARGETS]
        lines.append(_row(f"`{study.name}`", [_ratio_words(ratio) for ratio in ratios]))
    return "\n".join(lines) + "\n"


def _ratio_words(ratio: float | None) -> str:
    if ratio is None:
        return "-"
    return f"{ratio:.2f}" if ratio < 10 else f"{ratio:.0f}"


def _rivals(study: SceneStudy) -> tuple[Point, ...]:
    """Return the points of methods that take no tolerance with a bound: all but `exact` and `auto`."""
    return tuple(point for point in study.points if point.tolerance is None)


def _ratio(study: SceneStudy, target: float) -> float | None:
    best = fastest(_rivals(study), target)
    certified = fastest((p for p in study.of("auto") if p.setting <= target), target)
    return None if best is None or certified is None else certified.seconds / best.seconds


def _losses(scenes: Sequence[SceneStudy]) -> list[str]:
    """Return in sentences how often volref loses, where most, and what no rival reaches."""
    ratios = [
        (ratio, study, target)
        for study in scenes
        for target in TARGETS
        if (ratio := _ratio(study, target)) is not None
    ]
    if not ratios:
        return []
    lost = [entry for entry in ratios if entry[0] > 1]
    lines = [f"volref loses {len(lost)} of these {len(ratios)} comparisons."]
    if lost:
        ratio, study, target = max(lost, key=lambda entry: entry[0])
        best = fastest(_rivals(study), target)
        assert best is not None
        lines.append(
            f"It loses most on `{study.name}` at {power_words(target)}: {_ratio_words(ratio)} times the "
            f"{seconds_words(best.seconds)} s of {_words(best)}."
        )
    for study in scenes:
        least = min((p.errors.largest.value for p in _rivals(study)), default=None)
        if least is not None:
            lines.append(
                f"- `{study.name}`: the least that a rival reached is an error of {power_words(least)}."
            )
    lines.insert(2 if lost else 1, "")
    return [*lines, ""]


def _section(study: SceneStudy, image: str | None) -> list[str]:
    across, down, deep = study.volume
    parts = [f"### {study.name}\n"]
    if image is not None:
        alt = (
            f"Error against seconds for the scene {study.name}, log-log: a panel for the largest error, one "
        )
        parts.append(f"![{alt}for the root of the mean square.]({image})\n")
    meaning = f"{study.meaning[0].upper()}{study.meaning[1:]}. "
    parts.append(
        f"{meaning}{study.width} x {study.height} pixels, {across} x {down} x {deep} voxels; the reference "
        f"is certified to {power_words(study.reference)}.\n"
    )
    parts.append(_reached_table(study))
    if study.stopped:
        parts.append("\n".join(f"- Left out: {words}." for words in study.stopped) + "\n")
    claims = _claims_table(study)
    return [*parts, "What the methods say of themselves:\n", claims] if claims else parts


def _reached_table(study: SceneStudy) -> str:
    """Return a row per method: the seconds to each target error, and the least error."""
    best = {target: fastest(study.points, target) for target in TARGETS}
    lines = _head("method", (*TARGETS, "least error"))
    for method in _methods(study):
        points = study.of(method.name)
        cells = []
        for target in TARGETS:
            point = fastest(points, target)
            words = "-" if point is None else seconds_words(point.seconds)
            winner = best[target]
            cells.append(f"**{words}**" if point is not None and point is winner else words)
        least = min((point.errors.largest for point in points), key=lambda error: error.value)
        cells.append(f"{'' if least.resolved else 'at most '}{least.value:.1g}")
        lines.append(_row(f"{method.title} (`{method.name}`)", cells))
    return "\n".join(lines) + "\n"


def _claims_table(study: SceneStudy) -> str:
    """Return a row per method with a bound: how often it holds, and how near the error is to it."""
    lines = [
        "| method | bound | pixels within it | tolerances met | largest error, of the largest bound |",
        "| --- | --- | --- | --- | --- |",
    ]
    for method in _methods(study):
        points = [p for p in study.of(method.name) if p.held is not None and p.bound]
        if not points:
            continue
        held = min(p.held or 0.0 for p in points)
        asked = [p for p in points if p.tolerance is not None]
        met = f"{sum(bool(p.met) for p in asked)} of {len(asked)}" if asked else "-"
        kinds = " or ".join(dict.fromkeys(p.bound_kind for p in points))
        known = [p.errors.largest.value / (p.bound or 1.0) for p in points if p.errors.largest.resolved]
        near = f"{max(known):.2g} times" if known else "-"
        every = "all" if held == 1 else f"{_floored(held)} at least"
        lines.append(_row(method.title, [kinds, every, met, near]))
    return "\n".join(lines) + "\n" if len(lines) > 2 else ""


def _floored(share: float) -> str:
    """Return a share in per cent, rounded down, so that 100 % means all."""
    return f"{int(share * 10000) / 100:g} %"


def _methods(study: SceneStudy) -> tuple[Method, ...]:
    return tuple(method for method in METHODS if method.name in study.methods)


def _words(point: Point) -> str:
    method = next(method for method in METHODS if method.name == point.method)
    return f"{method.title}, {setting_words(method, point.setting)}"


def _head(first: str, columns: Iterable[float | str]) -> list[str]:
    names = [column if isinstance(column, str) else power_words(column) for column in columns]
    return [_row(first, names), "| " + " | ".join(["---"] * (len(names) + 1)) + " |"]


def _row(first: str, cells: Iterable[str]) -> str:
    return "| " + " | ".join((first, *cells)) + " |"


def seconds_words(seconds: float) -> str:
    """Return seconds with two digits.

    Examples
    --------
    >>> seconds_words(0.0123), seconds_words(3.0), seconds_words(123.4)
    ('0.012', '3.0', '123')
    """
    if seconds >= 10:
        return f"{seconds:.0f}"
    digits = 1 if seconds >= 1 else 2 if seconds >= 0.1 else 3 if seconds >= 0.01 else 4
    return f"{seconds:.{digits}f}"
