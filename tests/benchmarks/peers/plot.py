"""The plot of the comparison: RMS error against CPU seconds, log-log, a panel for each problem."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from tests.benchmarks.peers.renderers import RENDERERS
from tests.benchmarks.peers.summary import runs_on
from volref.io.atomic import atomic_path
from volref.report.plots import check_matplotlib

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Colours of Okabe and Ito (2008), a mark of its own for each: volref's dark and thick, the others' light.
STYLES = {
    "volref-march32": ("#0072B2", "o", 2.2),
    "volref-march": ("#1F4E79", "h", 2.2),
    "volref-auto": ("#D55E00", "X", 2.2),
    "volref-exact": ("#000000", "D", 2.2),
    "vtk-fixed": ("#8A8A8A", "s", 1.2),
    "vtk-gpu": ("#56B4E9", "v", 1.2),
    "scipy": ("#009E73", "P", 1.2),
    "numba": ("#E69F00", "^", 1.2),
    "drjit": ("#CC79A7", "p", 1.2),
}
ACROSS = 3


def save_plot(figures: dict[str, Any], path: Path) -> None:
    """Write the plot, as .svg or .png by the suffix."""
    check_matplotlib()
    import matplotlib as mpl
    from matplotlib.figure import Figure

    # Letters as outlines look the same everywhere; without salt and date equal plots are equal files.
    with mpl.rc_context({"font.family": "DejaVu Sans", "font.size": 9, "svg.hashsalt": "volref"}):
        down = -(-(len(figures["problems"]) + 1) // ACROSS)
        figure = Figure(figsize=(11.0, 3.6 * down), dpi=150, facecolor="white", layout="constrained")
        draw(figures, figure, down)
        metadata: dict[str, Any] = {"Date": None} if path.suffix == ".svg" else {}
        with atomic_path(path, overwrite=True) as temporary:
            figure.savefig(temporary, metadata=metadata)


def draw(figures: dict[str, Any], figure: "Figure", down: int) -> None:
    """Draw the panels, and the legend into the one that is left."""
    panels = figure.subplots(down, ACROSS, sharex=True, sharey=True, squeeze=False).ravel()
    problems = figures["problems"]
    for number, (axes, problem) in enumerate(zip(panels, problems, strict=False)):
        _panel(axes, figures, problem["name"])
        if number % ACROSS == 0:
            axes.set_ylabel("root mean square error (1 is white)")
        if number + ACROSS >= len(problems):
            axes.set_xlabel("CPU seconds, one thread")
            axes.tick_params(labelbottom=True)
    for axes in panels[len(problems) :]:
        axes.axis("off")
    handles = {
        label: handle
        for axes in panels[: len(problems)]
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    known = [renderer.title for renderer in RENDERERS.values() if renderer.title in handles]
    panels[-1].legend([handles[label] for label in known], known, loc="center", frameon=False, fontsize=10)


def _panel(axes: "Axes", figures: dict[str, Any], problem: str) -> None:
    axes.set(xscale="log", yscale="log")
    axes.set_title(problem, loc="left", fontsize=10)
    axes.grid(visible=True, which="major", color="#E8EAED", linewidth=0.8)
    axes.spines[["top", "right"]].set_visible(False)
    for name, run in runs_on(figures, problem).items():
        color, mark, width = STYLES[name]
        points = run["points"]
        axes.plot(
            [point["seconds"] for point in points], [max(point["rms"], 1e-17) for point in points],
            color=color, marker=mark, linewidth=width, markersize=4.5 if width < 2 else 6,
            label=RENDERERS[name].title, zorder=3 if width < 2 else 4,
        )  # fmt: skip
