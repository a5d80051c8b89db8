"""The comparison as a section of the page: tables, ratios, losses, in Markdown."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

from tests.benchmarks.peers.renderers import RENDERERS
from tests.benchmarks.peers.summary import (
    LEVELS,
    Duel,
    Reached,
    Run,
    at_setting,
    duels,
    fastest_of_ours,
    reach,
    runs_on,
)
from volref.studies.precision.methods import power_words

MEANINGS = {
    "blobs128": "fourteen Gaussian blobs, a smooth table, much of the box clear",
    "dense128": "the same blobs, four to six times as opaque: a quarter of the pixels saturate",
    "ml128": "the signal of Marschner and Lobb under a table with a narrow peak, nothing clear",
    "blobs128+mesh20k": "the first with an opaque sphere of 20480 triangles inside",
    "chest-ct": "a chest CT with 3D Slicer's preset CT-Chest-Contrast-Enhanced, knots at whole HU",
}

INTRODUCTION = """\
The same scenes by other renderers that run on a CPU, each at a ladder of settings: VTK's fixed-point ray
caster; VTK's GPU ray caster on software GL; and marchers of some fifty lines in SciPy, Numba and Dr.Jit, as
one would write them for a paper.

- **Seconds** are CPU seconds of the process for one frame, {side} pixels wide, on one core and one thread:
  the median of three frames, or a single one where a frame takes more than {slow:g} s. Imports, uploads,
  compilation, and what volref keeps of a volume from one frame to the next are not in them. Every renderer
  has a process of its own for each scene.
- **Error** is the root mean square over the premultiplied colours of {judged} pixels, one at random in each
  block of 8 x 8 (with a mesh, those within 1.5 pixels of its outline left out). Their truth is volref's own
  certified integral, here proven to {bound}. It has a check: the errors of independent marchers
  fall towards it by a factor of four with each halving of the step.
- **Seconds to an error** are interpolated between the rungs of a ladder on a log-log scale. `<=`: the
  coarsest rung was that good already. `>`: the ladder ended there, by its last
  rung or because the next would have taken too long, the error still falling. "never": it fell no more.
- **In brackets**: how many times as long as the fastest of volref's ways it takes; **below 1 volref
  loses**. Step and estimated tolerance are chosen by hindsight, for all. Only the certified image tells its
  error without knowing the truth.
- All draw the same trilinear field with samples on the faces of the box, the same table, camera and mesh.
  VTK gets its table as opacities of one step, jitter off, one ray to a pixel. Steps are in voxels (the
  least spacing).
"""


def side_by_side(figures: dict[str, Any]) -> str:
    """Return the section, without its title."""
    bound = max((problem["truth_bound"] for problem in figures["problems"]), default=0.0)
    judged = sorted({problem["judged"] for problem in figures["problems"]}) or [0]
    counts = f"{judged[0]} to {judged[-1]}" if len(judged) > 1 else str(judged[0])
    found = duels(figures)
    parts = [
        INTRODUCTION.format(
            side=figures["side"], slow=figures["slow"], judged=counts, bound=power_words(bound)
        ),
        _software(figures),
        "### Where volref wins, and where it loses\n",
        "\n".join([*_wins(found), "", *_losses(found), ""]),
        "### Seconds to an error\n",
    ]
    parts += [_reaching(figures, problem, found) for problem in figures["problems"]]
    parts += ["### At equal step\n", _at_equal_step(figures)]
    parts += ["### With a mesh\n", _with_mesh(figures)] if _mesh_pairs(figures) else []
    parts += ["### The least error\n", _least_errors(figures)]
    return "\n".join(parts)


def _software(figures: dict[str, Any]) -> str:
    versions = ", ".join(f"{name} {version}" for name, version in figures["packages"].items())
    remarks = {run["remark"] for run in figures["runs"] if run["remark"]}
    lines = [f"Packages: {versions or 'none'}. {'; '.join(sorted(remarks))}".rstrip("; ") + "."]
    for entry in figures["absent"]:
        where = "" if entry["problem"] is None else f" on `{entry['problem']}`"
        lines.append(f"- Left out: {RENDERERS[entry['renderer']].title}{where}: {entry['why']}.")
    return "\n".join([lines[0], "", *lines[1:], ""])


def _wins(found: Sequence[Duel]) -> list[str]:
    """Return in sentences how often volref wins, against whom, and by how much."""
    won, lost = (sum(duel.outcome == outcome for duel in found) for outcome in ("won", "lost"))
    lines = [
        f"Of {len(found)} comparisons volref wins {won} and loses {lost}; in {len(found) - won - lost} "
        "neither got there, or the other's ladder ended before volref's time.\n"
    ]
    for renderer in dict.fromkeys(duel.renderer for duel in found):
        own = [duel for duel in found if duel.renderer == renderer]
        ratios = [duel.ratio for duel in own if duel.theirs.done and duel.ours is not None]
        missed = sum(not duel.theirs.done for duel in own)
        span = " to ".join(dict.fromkeys(times(pick(ratios)) for pick in (min, max))) if ratios else ""
        words = [f"takes {span} times as long"] if ratios else []
        words += [f"does not get there in {missed} of {len(own)}"] if missed else []
        lines.append(f"- {RENDERERS[renderer].title}: {'; '.join(words)}.")
    for level in dict.fromkeys(duel.level for duel in found):
        at_level = [duel for duel in found if duel.level == level]
        alone = not any(duel.theirs.done for duel in at_level)
        if alone and all(duel.ours is not None for duel in at_level):
            lines.append(f"- At {power_words(level)} volref alone gets there, and does so on every scene.")
    return lines


def _losses(found: Sequence[Duel]) -> list[str]:
    """Return in sentences where volref loses: a line for each renderer and problem."""
    lost = [duel for duel in found if duel.outcome == "lost"]
    if not lost:
        return ["It loses none of them."]
    lines = ["It loses:\n"]
    for renderer, problem in dict.fromkeys((duel.renderer, duel.problem) for duel in lost):
        own = [duel for duel in lost if (duel.renderer, duel.problem) == (renderer, problem)]
        words = ", ".join(
            f"at {power_words(duel.level)} "
            + ("it did not get there" if duel.ours is None else f"{times(1 / duel.ratio)} times as slow")
            for duel in own
        )
        lines.append(f"- to {RENDERERS[renderer].title} on `{problem}`: {words}.")
    return lines


def _reaching(figures: dict[str, Any], problem: dict[str, Any], found: Sequence[Duel]) -> str:
    """Return the table of one problem: a row per renderer, a column per error."""
    name, runs = problem["name"], runs_on(figures, problem["name"])
    size = " x ".join(str(count) for count in problem["volume"])
    rows = [
        f"`{name}`: {MEANINGS.get(name, 'a scene')}. {size} voxels, {problem['width']} x {problem['height']} "
        f"pixels, {problem['samples'] / 1e6:.1f} million samples at a step of one voxel.\n",
        *head(["renderer", *(power_words(level) for level in LEVELS)]),
    ]
    for renderer, run in runs.items():
        cells = [RENDERERS[renderer].title]
        for level in LEVELS:
            words = reached_words(reach(run["points"], level))
            best = fastest_of_ours(runs, level)
            if RENDERERS[renderer].ours:
                cells.append(f"**{words}**" if best is not None and best[0] == renderer else words)
            else:
                cells.append(words + _ratio_of(found, name, renderer, level))
        rows.append(row(cells))
    return "\n".join([*rows, ""])


def _ratio_of(found: Iterable[Duel], problem: str, renderer: str, level: float) -> str:
    """Return the ratio of a duel in brackets, if there is one to tell."""
    for duel in found:
        if (duel.problem, duel.renderer, duel.level) == (problem, renderer, level):
            if not math.isfinite(duel.ratio) or duel.ours is None:
                return ""
            if duel.theirs.kind == "beyond" and duel.ratio < 1:
                return ""  # more than a part of volref's time says nothing
            mark = {"=": "", "~": "about "}.get(duel.certain, duel.certain + " ")
            return f" ({mark}{times(duel.ratio)})"
    return ""


def _at_equal_step(figures: dict[str, Any]) -> str:
    """Return the seconds of a frame at one voxel, and VTK's fixed-point caster over volref's march."""
    names = [problem["name"] for problem in figures["problems"]]
    runs = {name: runs_on(figures, name) for name in names}
    rows = ["Seconds of a frame at a step of one voxel, and its error.\n", *head(["renderer", *names])]
    for renderer in _in_order(figures, "step"):
        points = [at_setting(runs[name].get(renderer), 1.0) for name in names]
        cells = ["-" if point is None else f"{_seconds(point)}, {point['rms']:.1e}" for point in points]
        rows.append(row([RENDERERS[renderer].title, *cells]))
    rows.append("")
    for name in names:
        fixed = at_setting(runs[name].get("vtk-fixed"), 1.0)
        ours = [at_setting(run, 1.0) for which, run in runs[name].items() if RENDERERS[which].ours]
        marched = [point["seconds"] for point in ours if point is not None]
        if fixed is not None and marched:
            ratio = fixed["seconds"] / min(marched)
            verb = "wins" if ratio > 1 else "loses"
            words = f"- `{name}`: VTK's fixed-point caster takes {times(ratio)} times as long"
            rows.append(f"{words} as volref's faster march: volref {verb}.")
    return "\n".join([*rows, ""])


def _mesh_pairs(figures: dict[str, Any]) -> list[tuple[str, str]]:
    """Return names of problems without a mesh and with one that are the same otherwise."""
    names = [problem["name"] for problem in figures["problems"]]
    pairs = [(name.partition("+")[0], name) for name in names if "+" in name]
    return [(bare, full) for bare, full in pairs if bare in names]


def _with_mesh(figures: dict[str, Any]) -> str:
    rows = []
    for bare, full in _mesh_pairs(figures):
        rows += [f"Error without and with the mesh, `{bare}` and `{full}`, at the same setting.\n"]
        rows += head(["renderer", "setting", "without", "with", "grows by"])
        for renderer, run in runs_on(figures, full).items():
            known = RENDERERS[renderer]
            if renderer == "volref-auto":
                continue  # it marches without the mesh and integrates exactly with it, or the reverse
            other = runs_on(figures, bare).get(renderer)
            setting = 1.0 if known.knob == "step" else known.ladder[-1]
            with_it, without = at_setting(run, setting), at_setting(other, setting)
            if with_it is None or without is None:
                continue
            growth = with_it["rms"] / max(without["rms"], 1e-300)
            errors = [f"{point['rms']:.1e}" for point in (without, with_it)]
            cells = [known.title, f"{known.knob} {setting:g}", *errors, f"{times(growth)} times"]
            rows.append(row(cells))
        rows.append("")
    return "\n".join(rows)


def _least_errors(figures: dict[str, Any]) -> str:
    """Return the least RMS error of each renderer on each problem, the largest error, and their cost."""
    names = [problem["name"] for problem in figures["problems"]]
    rows = ["The most exact rung: RMS error, largest error, seconds.\n", *head(["renderer", *names])]
    for renderer in _in_order(figures):
        cells = [RENDERERS[renderer].title]
        for name in names:
            run = runs_on(figures, name).get(renderer)
            cells.append("-" if run is None or not run["points"] else _least(run))
        rows.append(row(cells))
    return "\n".join([*rows, ""])


def _least(run: Run) -> str:
    point = min(run["points"], key=lambda point: float(point["rms"]))
    return f"{point['rms']:.1e}, {point['largest']:.1e}, {_seconds(point)}"


def _in_order(figures: dict[str, Any], knob: str | None = None) -> list[str]:
    """Return the renderers that ran, in the order of the registry."""
    ran = {run["renderer"] for run in figures["runs"]}
    return [name for name, known in RENDERERS.items() if name in ran and knob in (None, known.knob)]


def _seconds(point: dict[str, Any]) -> str:
    return f"{seconds_words(point['seconds'])} s"


def reached_words(reached: Reached) -> str:
    """Return what it takes to reach an error in a cell.

    Examples
    --------
    >>> [reached_words(Reached(kind, 0.125)) for kind in ("met", "at once", "beyond", "never")]
    ['0.12', '<= 0.12', '> 0.12', 'never']
    """
    if reached.kind == "never":
        return "never"
    mark = {"at once": "<= ", "beyond": "> "}.get(reached.kind, "")
    return mark + seconds_words(reached.seconds)


def seconds_words(seconds: float) -> str:
    """Return seconds with two digits, or whole.

    Examples
    --------
    >>> [seconds_words(s) for s in (0.0523, 0.52, 5.23, 52.3)]
    ['0.052', '0.52', '5.2', '52']
    """
    return f"{seconds:.0f}" if seconds >= 10 else f"{seconds:#.2g}".rstrip(".")


def times(ratio: float) -> str:
    """Return a ratio with two digits, or whole.

    Examples
    --------
    >>> [times(r) for r in (0.314, 3.14, 31.4)]
    ['0.31', '3.1', '31']
    """
    return seconds_words(ratio)


def head(cells: Sequence[str]) -> list[str]:
    """Return the head of a table."""
    return [row(cells), row(["---"] * len(cells))]


def row(cells: Sequence[str]) -> str:
    """Return a row of a table."""
    return f"| {' | '.join(cells)} |"
