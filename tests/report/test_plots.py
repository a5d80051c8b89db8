"""The plot of a precision study: what is drawn, that labels stand apart, and what is refused."""

import math
import re
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from PIL import Image

from volref import FormatError
from volref.image import decode_srgb
from volref.report import plots
from volref.report.plots import STYLES, draw, free_place, plot_paths, save_precision_plot, shares_of
from volref.studies.precision.frontier import frontier
from volref.studies.precision.methods import LEGEND, METHODS
from volref.studies.precision.points import Error, Errors, Point, SceneStudy


def point(method, setting, seconds, largest, *, resolved=True):
    error = Error(largest, resolved)
    errors = Errors(error, Error(largest / 10, resolved), error, 0.0)
    return Point(method, setting, method, errors, seconds, 1, None, 1000, "none", None, None, None)


def crowded():
    """A study of every method, with points all over the panel and a frontier of many families."""
    rng = np.random.default_rng(3)
    points = [
        point(
            m.name, setting, 10 ** rng.uniform(-3, 1), 10 ** rng.uniform(-13, 0), resolved=rng.random() > 0.2
        )
        for m in METHODS
        for setting in m.ladder
    ]
    return SceneStudy("crowded", "a scene", 40, 30, (4, 4, 4), 1e-14, tuple(points), ())


def drawn(study):
    figure = Figure(figsize=(9.6, 5.6), dpi=150, layout="constrained")
    draw(study, figure)
    return figure


@pytest.fixture(scope="module")
def figure():
    return drawn(crowded())


def boxes(axes):
    """The boxes of the labels, without the lines that lead to them."""
    return [Text.get_window_extent(text) for text in axes.texts if text.get_text() != "half a grey level"]


def test_there_is_a_panel_for_the_largest_error_and_one_for_the_rms(figure):
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles == ["largest error of a pixel", "root mean square error"]
    assert (
        {axes.get_xscale() for axes in figure.axes} == {axes.get_yscale() for axes in figure.axes} == {"log"}
    )


def test_every_point_is_drawn_once_in_each_panel_with_the_mark_of_its_family(figure):
    study = crowded()
    for axes, measure in zip(figure.axes, ("largest", "rms"), strict=True):
        shown = [
            (line.get_marker(), x, y)
            for line in axes.lines
            if line.get_linestyle() == "None" and line.get_label() != "not beaten by any"
            for x, y in zip(*line.get_data(), strict=True)
        ]
        expected = [
            (STYLES[plots.BY_NAME[p.method].family][1], p.seconds, getattr(p.errors, measure).value)
            for p in study.points
        ]
        assert sorted(shown) == sorted(expected)


def test_rings_mark_the_frontier_of_each_measure(figure):
    for axes, measure in zip(figure.axes, ("largest", "rms"), strict=True):
        [rings] = [line for line in axes.lines if line.get_label() == "not beaten by any"]
        best = frontier(crowded().points, measure)
        assert rings.get_xdata().tolist() == [p.seconds for p in best]
        assert rings.get_ydata().tolist() == [getattr(p.errors, measure).value for p in best]


def test_marks_are_hollow_where_an_error_is_only_known_to_be_at_most_so_large():
    study = SceneStudy(
        "s", "", 4, 3, (4, 4, 4), 1e-14, (point("exact", 1e-12, 1.0, 1e-14, resolved=False),), ()
    )
    axes = drawn(study).axes[0]
    marks = [line for line in axes.lines if len(line.get_xdata()) and line.get_marker() == "D"]
    assert [line.get_markerfacecolor() for line in marks] == ["white"]


def test_the_legend_names_every_family_in_order(figure):
    [legend] = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [*LEGEND, "not beaten by any"]


def test_labels_cover_neither_each_other_nor_leave_the_panel(figure):
    figure.draw_without_rendering()  # puts them where they were told to be
    for axes, measure in zip(figure.axes, ("largest", "rms"), strict=True):
        labels = boxes(axes)
        assert len(labels) >= 4
        assert len(labels) == len(shares_of(frontier(crowded().points, measure)))
        frame = axes.get_window_extent()
        for i, box in enumerate(labels):
            assert frame.contains(box.x0, box.y0)
            assert frame.contains(box.x1, box.y1)
            assert not any(box.overlaps(other) for other in labels[:i])


def test_a_label_goes_where_it_covers_no_mark():
    frame, box = Bbox.from_extents(0, 0, 1000, 1000), Bbox.from_extents(450, 490, 550, 510)
    right = np.array([(x, y) for x in range(500, 1000, 5) for y in range(0, 1000, 5)])
    across, up = free_place(box, frame, [], right)
    assert across < -50
    assert free_place(box, Bbox.from_extents(440, 480, 560, 520), [], right) is None
    taken = [Bbox.from_extents(0, 0, 499, 1000)]
    assert free_place(box, frame, taken, right)[0] > 0  # rather over marks than over another label
    assert math.hypot(across, up) < 300


def test_a_family_has_one_label_with_its_settings_on_the_frontier():
    points = [
        point("left-exponential", 4.0, 1, 1e-1),
        point("cell-gauss-2", 1, 2, 1e-2),
        point("midpoint-exponential", 0.25, 3, 1e-3),
        point("cell-gauss-3", 4, 4, 1e-4),
        point("exact", 1e-6, 5, 1e-6),
        point("exact", 1e-12, 6, 1e-12),
    ]
    assert [share.label for share in shares_of(points)] == [
        "opacity-corrected, step 4 to 1/4",
        "Gauss in each cell",
        "volref, certified, 1e-6 to 1e-12",
    ]
    assert shares_of(points[3:4])[0].label == "Gauss in each cell, 4 parts"


def test_every_family_has_a_colour_and_a_mark_of_its_own_that_white_paper_shows():
    assert set(STYLES) == set(LEGEND)
    assert (
        len({color for color, _ in STYLES.values()})
        == len({mark for _, mark in STYLES.values()})
        == len(STYLES)
    )
    for color, _ in STYLES.values():
        luminance = decode_srgb(np.array(to_rgb(color))) @ (0.2126, 0.7152, 0.0722)
        assert 1.05 / (luminance + 0.05) > 2  # WCAG's contrast; marks are larger than letters


def test_errors_beyond_the_edges_are_drawn_at_them():
    found = [plots.height(point("trapezoid", 1.0, 1.0, error), "largest") for error in (math.inf, 0.5, 0.0)]
    assert found == [plots.MOST_ERROR, 0.5, plots.LEAST_ERROR]


# --- files


@pytest.fixture
def study():
    return SceneStudy("few", "", 4, 3, (4, 4, 4), 1e-14, (point("march", 1.0, 1.0, 0.1),), ())


def test_equal_studies_are_equal_svg_files_without_a_date_and_a_crowded_one_stays_small(tmp_path):
    for name in ("a.svg", "b.svg"):
        save_precision_plot(crowded(), tmp_path / name)
    text = (tmp_path / "a.svg").read_bytes()
    assert text == (tmp_path / "b.svg").read_bytes()
    assert b"dc:date" not in text
    assert len(text) < 300_000
    assert ElementTree.fromstring(text).tag.endswith("svg")


def test_png_is_written_on_white_at_a_size_that_can_be_read(study, tmp_path):
    save_precision_plot(study, tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as image:
        assert image.size == (1440, 840)
        assert image.convert("RGB").getpixel((2, 400)) == (255, 255, 255)


def test_a_file_that_exists_is_kept_unless_told_otherwise(study, tmp_path, monkeypatch):
    monkeypatch.setattr(plots, "draw", lambda *_: None)
    (tmp_path / "a.svg").write_text("mine")
    with pytest.raises(FormatError, match="must not exist yet"):
        save_precision_plot(study, tmp_path / "a.svg")
    save_precision_plot(study, tmp_path / "a.svg", overwrite=True)
    assert (tmp_path / "a.svg").read_text() != "mine"


def test_other_suffixes_are_refused(study, tmp_path):
    with pytest.raises(FormatError, match=re.escape("must end in .svg or .png, got '.pdf'; rename it")):
        save_precision_plot(study, tmp_path / "a.pdf")


def test_several_scenes_have_a_file_each():
    assert [p.name for p in plot_paths("out/p.png", ["a", "b"]).values()] == ["p-a.png", "p-b.png"]
    assert plot_paths("out/p.png", ["a"])["a"].as_posix() == "out/p.png"


def test_without_matplotlib_it_is_refused_with_the_cure(study, tmp_path, monkeypatch):
    monkeypatch.setattr(plots, "find_spec", lambda _: None)
    with pytest.raises(FormatError, match=re.escape("pip install 'volref[plot]'")):
        save_precision_plot(study, tmp_path / "a.svg")
