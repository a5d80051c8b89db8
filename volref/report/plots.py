"""The plot of a precision study: error against seconds, log-log, for people.

Two panels, the largest error and the root of the mean square.  Each family of methods is a line along those
of its points that no other of the family beats, the rest are faint; rings mark what no method beats at all,
and labels say which it is.  Colours are those of Okabe and Ito (2008), which the colour-blind can tell apart,
and every family has a mark of its own.
"""

import math
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from volref.arrays import Floats
from volref.errors import FormatError
from volref.io.atomic import atomic_path
from volref.planning import HALF_LEVEL
from volref.studies.precision.frontier import error_of, frontier
from volref.studies.precision.methods import LEGEND, METHODS, setting_words
from volref.studies.precision.points import Point, SceneStudy

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Annotation
    from matplotlib.transforms import Bbox

SUFFIXES = (".svg", ".png")

PANELS = (("largest", "largest error of a pixel"), ("rms", "root mean square error"))

# Colour and mark of each family, in the order of the legend.
STYLES = {
    "volref march": ("#0072B2", "o"),
    "volref, certified": ("#000000", "D"),
    "volref, estimated": ("#D55E00", "X"),
    "Riemann or trapezoid": ("#8A8A8A", "s"),
    "opacity-corrected": ("#56B4E9", "v"),
    "pre-integrated": ("#E69F00", "^"),
    "Gauss in each cell": ("#009E73", "P"),
    "adaptive halving": ("#CC79A7", "p"),
}
OTHER = ("#5C4033", "*")

# Errors above this are no images any more, those below it no float64 shows: they are drawn at the edges.
LEAST_ERROR, MOST_ERROR = 1e-17, 3.0

BY_NAME = {method.name: method for method in METHODS}

LABEL_SIZE = 8

GREY, INK = "#9AA0A6", "#202124"


class Share(NamedTuple):
    """A family's part of the frontier."""

    family: str
    points: tuple[Point, ...]

    @property
    def label(self) -> str:
        """The family, and its settings from the coarsest to the finest."""
        first, last = self.points[0], self.points[-1]
        coarse, fine = (setting_words(BY_NAME[point.method], point.setting) for point in (first, last))
        if BY_NAME[first.method].knob == "parts" and first.method != last.method:
            return self.family
        return f"{self.family}, {coarse}" + (f" to {fine.removeprefix('step ')}" if fine != coarse else "")


def shares_of(points: Sequence[Point]) -> list[Share]:
    """Return a frontier family by family, so that each needs one label however often they take turns."""
    families = dict.fromkeys(BY_NAME[point.method].family for point in points)
    return [Share(f, tuple(p for p in points if BY_NAME[p.method].family == f)) for f in families]


def plot_paths(path: str | Path, names: Sequence[str]) -> dict[str, Path]:
    """Return where the plot of each scene goes: `path`, or with several scenes their names before its suffix.

    Raises
    ------
    FormatError
        If the suffix is neither .svg nor .png.

    Examples
    --------
    >>> [path.as_posix() for path in plot_paths("p.svg", ["smooth", "spiky"]).values()]
    ['p-smooth.svg', 'p-spiky.svg']
    """
    target = Path(path)
    if target.suffix.lower() not in SUFFIXES:
        message = f"{target} must end in {' or '.join(SUFFIXES)}, got {target.suffix!r}; rename it"
        raise FormatError(message)
    if len(names) == 1:
        return {names[0]: target}
    return {name: target.with_name(f"{target.stem}-{name}{target.suffix}") for name in names}


def check_matplotlib() -> None:
    """Refuse to plot where matplotlib is missing.

    Raises
    ------
    FormatError
        If it is.
    """
    if find_spec("matplotlib") is None:
        message = "a plot must be drawn by matplotlib, got none installed; pip install 'volref[plot]'"
        raise FormatError(message)


def save_precision_plot(study: SceneStudy, path: str | Path, *, overwrite: bool = False) -> None:
    """Write the plot of one scene as .svg or .png.

    Raises
    ------
    FormatError
        If the suffix is another one, matplotlib is missing, or the file exists and `overwrite` is False.
    """
    target = plot_paths(path, [study.name])[study.name]
    check_matplotlib()
    import matplotlib as mpl
    from matplotlib.figure import Figure

    # Letters as outlines look the same everywhere; without salt and date equal plots are equal files.
    with mpl.rc_context({"font.family": "DejaVu Sans", "font.size": 9, "svg.hashsalt": "volref"}):
        figure = Figure(figsize=(9.6, 5.6), dpi=150, facecolor="white", layout="constrained")
        draw(study, figure)
        metadata: dict[str, Any] = {"Date": None} if target.suffix.lower() == ".svg" else {}
        with atomic_path(target, overwrite=overwrite) as temporary:
            figure.savefig(temporary, metadata=metadata)


def draw(study: SceneStudy, figure: "Figure") -> None:
    """Draw the panels and the legend of a study into an empty figure."""
    panels = figure.subplots(1, len(PANELS), sharex=True, sharey=True)
    for axes, (measure, title) in zip(panels, PANELS, strict=True):
        _panel(axes, study, measure)
        axes.set_title(title, loc="left", fontsize=10)
        axes.set_xlabel("CPU seconds on one thread")
    panels[0].set_ylabel("error (1 is white)")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    figure.suptitle(f"{study.name}, {study.width} x {study.height} pixels", x=0.01, ha="left", fontsize=12)
    figure.draw_without_rendering()  # settles the layout: before that no label has a place
    figure.set_layout_engine("none")
    for axes, (measure, _) in zip(panels, PANELS, strict=True):
        place_labels(axes, study.points, measure)


def _panel(axes: "Axes", study: SceneStudy, measure: str) -> None:
    axes.set(xscale="log", yscale="log")
    axes.grid(visible=True, which="major", color="#E8EAED", linewidth=0.8)
    axes.spines[["top", "right"]].set_visible(False)
    axes.axhline(HALF_LEVEL, color=GREY, linewidth=0.8, linestyle=(0, (4, 3)))
    axes.annotate(
        "half a grey level", (1, HALF_LEVEL), xycoords=("axes fraction", "data"), xytext=(-2, 2),
        textcoords="offset points", ha="right", va="bottom", fontsize=7.5, color="#5F6368", zorder=6,
        bbox={"boxstyle": "square,pad=0.1", "facecolor": "white", "alpha": 0.8, "linewidth": 0},
    )  # fmt: skip
    for family in LEGEND:
        points = [point for point in study.points if BY_NAME[point.method].family == family]
        if points:
            _line(axes, family, points, measure)
    best = frontier(study.points, measure)
    axes.plot(
        [p.seconds for p in best], [height(p, measure) for p in best], linestyle="none", marker="o",
        markersize=11, markerfacecolor="none", markeredgecolor=INK, markeredgewidth=0.9, zorder=5,
        label="not beaten by any",
    )  # fmt: skip


def _line(axes: "Axes", family: str, points: Sequence[Point], measure: str) -> None:
    color, mark = STYLES.get(family, OTHER)
    best = frontier(points, measure)
    rest = [point for point in points if point not in best]
    axes.plot(
        [p.seconds for p in best], [height(p, measure) for p in best],
        color=color, linewidth=1.6, zorder=3,
    )  # fmt: skip
    axes.plot([], [], color=color, linewidth=1.6, marker=mark, markersize=5.5, label=family)
    for group, alpha, size in ((best, 1.0, 5.5), (rest, 0.35, 4.0)):
        for resolved in (True, False):
            chosen = [p for p in group if error_of(p, measure).resolved is resolved]
            axes.plot(
                [p.seconds for p in chosen], [height(p, measure) for p in chosen], linestyle="none",
                marker=mark, markersize=size, alpha=alpha, color=color, zorder=4,
                markerfacecolor=color if resolved else "white",
            )  # fmt: skip


def height(point: Point, measure: str) -> float:
    """Return where a point's error is drawn: those beyond the edges at the edges."""
    return min(max(error_of(point, measure).value, LEAST_ERROR), MOST_ERROR)


def place_labels(axes: "Axes", points: Sequence[Point], measure: str) -> list["Annotation"]:
    """Name the families on the frontier of `points`, each where it covers no other name and few marks.

    Returns the labels that found a place inside the panel; what finds none is left out.
    """
    marks = axes.transData.transform([(p.seconds, height(p, measure)) for p in points])
    frame = axes.get_window_extent()
    taken = [text.get_window_extent() for text in axes.texts]
    points_per_pixel = 72 / axes.figure.dpi
    labels = []
    for share in shares_of(frontier(points, measure)):
        point = share.points[len(share.points) // 2]
        anchor = point.seconds, height(point, measure)
        probe = axes.text(*anchor, share.label, ha="center", va="center", fontsize=LABEL_SIZE)
        box = probe.get_window_extent().padded(3)
        probe.remove()
        place = free_place(box, frame, taken, marks)
        if place is None:
            continue
        taken.append(box.translated(*place))
        labels.append(
            axes.annotate(
                share.label, anchor, xytext=(place[0] * points_per_pixel, place[1] * points_per_pixel),
                textcoords="offset points", ha="center", va="center",
                fontsize=LABEL_SIZE, color=INK, zorder=6,
                arrowprops={"arrowstyle": "-", "color": INK, "linewidth": 0.6, "shrinkA": 0, "shrinkB": 6},
                bbox={"boxstyle": "square,pad=0.1", "facecolor": "white", "alpha": 0.8, "linewidth": 0},
            )
        )  # fmt: skip
    return labels


def free_place(
    box: "Bbox", frame: "Bbox", taken: Sequence["Bbox"], marks: Floats
) -> tuple[float, float] | None:
    """Return by how many pixels to move a label from its anchor, in whose middle `box` lies; None: nowhere.

    The label stays in the frame, off what is taken, off the `marks` (n, 2) if it can, and near.
    """
    best, cheapest = None, math.inf
    for radius in range(30, 300, 10):
        for turn in range(24):
            across, up = math.cos(turn * math.pi / 12), math.sin(turn * math.pi / 12)
            # Pushed out by half its width, so that its near end is at the radius.
            place = across * (radius + box.width / 2), up * radius
            there = box.translated(*place)
            inside = frame.contains(there.x0, there.y0) and frame.contains(there.x1, there.y1)
            if not inside or any(there.overlaps(other) for other in taken):
                continue
            covered = ((marks > there.min) & (marks < there.max)).all(axis=1).sum()
            cost = radius + 80 * int(covered)
            if cost < cheapest:
                best, cheapest = place, cost
    return best
