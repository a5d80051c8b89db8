"""Faults that real WebGL draws are rejected and called by their names; docs/power.md has all of them."""

from collections.abc import Iterator

import pytest

from tests.webgl.faulty_rows import FAULTY, Faulty
from tests.webgl.power import PAGE, acceptance_of, clean_canvas, leaving, moved_by, names_of, verdict_of
from volref.oracle.faults.table import FAULTS
from volref.oracle.verdict import check

# Pictures that are explained here too, not on the page alone: the quicker ones, of all kinds.
NAMED = (
    Faulty("G1-half-voxel", 0.5, "f-shape"),
    Faulty("G4-flip-y", 1, "f-shape"),
    Faulty("O1-uncorrected", 1, "grey-slab"),
    Faulty("T2-last-step-doubled", 1, "grey-slab"),
    Faulty("T4-step", 1.1, "thin-slab"),
    Faulty("L1-half-texel", 0.5, "two-entries"),
    Faulty("F1-nearest", 1, "checkers"),
    Faulty("B1-blended-twice", 1, "on-a-background"),
)

# The seeds' own, as their papers print them.
SEEDS = {
    "seed 001, equation 4": Faulty("O2-add-alpha", 1, "f-atlas"),
    "seed 001, equation 17": Faulty("A3-mix-by-x", 1, "f-atlas"),
    "seed 002, A += a": Faulty("O2-add-alpha", 1, "values-as-opacity"),
    "seed 000, alpha": Faulty("D2-squared-alpha", 1, "sheet-through"),
    "seed 000, packing": Faulty("D1-packing", 1, "sheet-through"),
    "seed 004, kernel": Faulty("N1-kernel", 1, "lit-turned"),
}

# What else these could be: one fault of each row that the seeds' programs can have.  The page tries all.
RIVALS = (
    "A1-row-divisor",
    "A2-last-tile",
    "A3-mix-by-x",
    "A3-no-interpolation",
    "O1-stale",
    "O2-add-alpha",
    "O5-straight-output",
    "T1-early-stop",
    "L2-short-table",
    "F1-nearest",
    "D1-packing",
    "D1-range",
    "D2-squared-alpha",
    "B1-blended-twice",
    "N1-kernel",
    "N1-sign",
)


@pytest.mark.parametrize("chart", sorted({row.chart for row in FAULTY}))
def test_a_chart_without_a_fault_is_inside(webgl, chart):
    assert check(clean_canvas(webgl, chart), acceptance_of(chart, webgl.name)).status == "inside"


@pytest.mark.parametrize("row", FAULTY, ids=str)
def test_a_fault_that_leaves_the_intervals_is_rejected(webgl, row):
    left = leaving(moved_by(webgl, row), acceptance_of(row.chart, webgl.name))
    assert not (left.any() and verdict_of(webgl, row).passed)


@pytest.mark.parametrize("row", FAULTY, ids=str)
def test_a_fault_is_seen_in_the_picture(swiftshader, row):
    assert moved_by(swiftshader, row).any()


@pytest.mark.parametrize("row", NAMED, ids=str)
def test_a_fault_has_its_name(swiftshader, row):
    assert names_of(swiftshader, row)[0] == row.key


@pytest.mark.parametrize("bug", SEEDS)
def test_the_seeds_own_bugs_have_their_names(swiftshader, bug):
    assert names_of(swiftshader, SEEDS[bug], RIVALS)[0] == SEEDS[bug].key


def test_every_name_is_that_of_a_known_fault():
    assert {row.key for row in (*FAULTY, *NAMED, *SEEDS.values())} <= set(FAULTS)
    assert set(RIVALS) <= set(FAULTS)


def shares() -> Iterator[dict[str, float]]:
    """Yield the shares of pictures, in percent, that the page gives for each implementation."""
    summary = PAGE.read_text(encoding="utf-8").split("## In sum")[1].split("##")[0]
    head, _, *rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in summary.splitlines()
        if line.startswith("|")
    ]
    for row in rows:
        cells = dict(zip(head, row, strict=True))
        inside, charts = map(int, cells["clean charts inside"].split(" of "))
        yield {"clean": 100 * inside / charts} | {
            name: float(cells[name].split(",")[1].removesuffix(" %"))
            for name in ("rejected", "named first", "first or second")
        }


def test_the_page_of_all_pictures_holds_what_is_promised():
    pages = list(shares())
    assert len(pages) == 2
    for found in pages:
        assert found["clean"] == 100
        assert found["rejected"] >= 98
        assert found["named first"] >= 90
        assert found["first or second"] >= 97
