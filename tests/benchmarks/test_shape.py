"""The benchmark measures what it says, on scenes of 16^3 samples; no time is judged here."""

import dataclasses
import json
import math

import numpy as np
import pytest

import volref as vr
from tests.benchmarks.page import PAGE, SECTIONS, load_results, performance_page, write_page
from tests.benchmarks.peers import comparing, numba_marcher, scipy_marcher
from tests.benchmarks.peers.comparing import PROBLEMS, compare
from tests.benchmarks.peers.measure import errors_of, measure, too_dear
from tests.benchmarks.peers.plot import STYLES
from tests.benchmarks.peers.problems import FIELDS, MESH_COLOR, chest_ct, problem_of
from tests.benchmarks.peers.renderers import RENDERERS, STEPS, Renderer
from tests.benchmarks.peers.section import MEANINGS, side_by_side
from tests.benchmarks.peers.summary import LEVELS, Reached, duels, fastest_of_ours, reach, runs_on
from tests.benchmarks.peers.truth import TOLERANCE, truth_of
from volref.stages.rays import pixel_rays

EPS = np.finfo(np.float64).eps
SMALL = {"side": 16, "max_seconds": 60.0}
OURS = [name for name, renderer in RENDERERS.items() if renderer.ours]


@pytest.fixture(scope="module")
def figures():
    """A whole comparison, in processes of its own, on the smallest scenes."""
    return compare(["blobs16", "blobs16+mesh1k"], ["volref-march", "volref-exact", "scipy"], **SMALL)


def run(problem, renderer, *points):
    """A made-up run; points are (seconds, RMS error)."""
    known = RENDERERS[renderer]
    return {
        "problem": problem, "renderer": renderer, "remark": "", "preparation": 0.0, "stopped": False,
        "points": [
            {"setting": setting, "seconds": seconds, "frames": 3, "rms": rms, "largest": 10 * rms,
             "rms_opacity": rms, "largest_opacity": rms}
            for setting, (seconds, rms) in zip(known.ladder, points, strict=False)
        ],
    }  # fmt: skip


def made_up(*runs):
    """Figures of a made-up comparison."""
    names = dict.fromkeys(run["problem"] for run in runs)
    about = {"width": 8, "height": 8, "volume": [4, 4, 4], "triangles": 0, "samples": 1e6, "judged": 64}
    return {
        "format": "volref-peers", "format_version": 1, "machine": "a machine", "date": "2026-01-02",
        "packages": {"scipy": "1"}, "side": 8, "max_seconds": 8.0, "slow": 1.0, "core": 0, "absent": [],
        "problems": [{"name": name, "truth_bound": 1e-12, **about} for name in names],
        "runs": list(runs),
    }  # fmt: skip


# --- the scenes


def test_the_rays_that_the_others_get_are_those_of_volref():
    for problem in (problem_of("ml16", 16), chest_ct(16)):
        rays = pixel_rays(
            problem.scene.camera, problem.width, problem.height, np.arange(problem.width * problem.height)
        )
        # either way some ten operations on numbers up to 1
        np.testing.assert_allclose(problem.directions, rays.directions, rtol=0, atol=16 * EPS)
        # volref's eye comes from the inverse of a matrix that holds numbers of its size
        size = np.abs(problem.eye).max()
        np.testing.assert_allclose(rays.origins - problem.eye, 0, atol=16 * EPS * size)


def test_an_index_and_its_world_point_belong_together():
    problem = chest_ct(16)
    volume = problem.scene.volume
    t = 700.0
    index = problem.index_eye + t * problem.index_directions
    world = np.array(problem.eye) + t * problem.directions
    there = index * volume.spacing + volume.origin
    # positions of some 1000 mm
    np.testing.assert_allclose(there, world, rtol=0, atol=1e3 * 16 * EPS)
    near, far = problem.spans
    hit = far > near
    ends = (problem.index_eye + t * problem.index_directions[hit] for t in (near[hit, None], far[hit, None]))
    for end in ends:
        off = np.maximum(-end, end - (problem.size - 1)).max(axis=1)
        np.testing.assert_allclose(off, 0, atol=1e-9)  # on a face: indices up to 1e3 of a box 1e3 away


def test_the_turned_scan_has_its_values_where_the_file_has_them():
    turned, filed = (
        chest_ct(16).scene.volume,
        vr.load_scene(PAGE.parents[1] / "tests/data/real_ct.json").volume,
    )
    index = np.random.default_rng(0).integers(0, np.array(filed.size), (100, 3))
    world = index @ filed.world_from_index[:3, :3].T + filed.world_from_index[:3, 3]
    place = world @ turned.index_from_world[:3, :3].T + turned.index_from_world[:3, 3]
    i, j, k = np.round(place).astype(int).T
    np.testing.assert_allclose(place, np.round(place), atol=1e-9)  # indices up to 256 from numbers to 1e3
    np.testing.assert_array_equal(turned.values[k, j, i], filed.values[index[:, 2], index[:, 1], index[:, 0]])


@pytest.mark.parametrize("name", [*FIELDS, "chest-ct"])
def test_a_table_of_the_stated_size_holds_the_transfer_function(name):
    problem = problem_of(name if name == "chest-ct" else f"{name}8", 8)
    table = problem.table(problem.entries)
    values = np.linspace(problem.knots[0], problem.knots[-1], 10 * problem.entries + 7)
    place = (values - problem.knots[0]) / np.ptp(problem.knots) * (problem.entries - 1)
    read = np.stack([np.interp(place, np.arange(problem.entries), channel) for channel in table.T])
    exact = np.vstack([problem.color(values), problem.extinction(values)])
    # interp is linear to rounding; -log1p(-a) over an entry is off by slope^2 / 8, and a has 2.4e-3 per HU
    off = 3e-6 if name == "chest-ct" else 64 * EPS * max(table.max(), 1)
    np.testing.assert_allclose(read, exact, rtol=0, atol=off)


def test_a_problem_that_is_not_known_is_refused():
    for name in ("blob16", "ml16+cube", "blobs"):
        with pytest.raises(ValueError, match="problem must be like"):
            problem_of(name)


def test_one_pixel_of_each_block_is_judged_and_none_at_the_outline_of_the_mesh():
    bare, full = problem_of("blobs16", 64), problem_of("blobs16+mesh1k", 64)
    y, x = np.divmod(bare.judged, 64)
    assert len(set(zip(y // 8, x // 8, strict=True))) == len(bare.judged) == 64
    assert set(full.judged) < set(bare.judged)


# --- the truth, and how the renderers come near it


@pytest.mark.parametrize("name", ["ml16", "dense16+mesh1k"])
def test_the_truth_is_the_image_that_render_certifies(name):
    problem = problem_of(name, 24)
    truth, image = truth_of(problem), vr.render(problem.scene, method="exact", tolerance=TOLERANCE)
    off = np.abs(image.rgba.reshape(-1, 4)[problem.judged] - truth.rgba).max(axis=1)
    assert (off <= truth.bound + image.bound.reshape(-1)[problem.judged]).all()
    assert truth.bound.max() <= TOLERANCE
    if problem.mesh is not None:
        assert (truth.rgba[:, 3] == 1).any()


@pytest.mark.parametrize(
    "name", [name for name, known in RENDERERS.items() if not set(known.needs) - {"scipy"}]
)
def test_the_error_falls_along_the_ladder(name):
    renderer = RENDERERS[name]
    problem = problem_of("blobs16+mesh1k" if renderer.meshes else "blobs16", 32)
    found = measure(renderer, problem, truth_of(problem).rgba, 60.0)
    assert [point["setting"] for point in found["points"]] == list(renderer.ladder)
    errors = [point["rms"] for point in found["points"]]
    assert errors[0] > 30 * errors[-1]
    if renderer.knob == "tolerance":
        assert all(point["largest"] <= point["setting"] for point in found["points"])
    else:  # second order: a factor of 4 from step to step, 4^5 over the ladder, rays' ends apart
        assert 4**4 < errors[0] / errors[-1] < 4**6


def test_what_numba_compiles_draws_what_the_scipy_marcher_draws():
    problem = problem_of("ml8", 8)
    by_loops, _ = numba_marcher.drawing(problem, numba_marcher.march)
    by_arrays, _ = scipy_marcher.prepare(problem)
    # the loops keep 1e-7 of an index off the far faces, where a value changes by up to 1 per index
    np.testing.assert_allclose(by_loops(0.5), by_arrays(0.5), rtol=0, atol=1e-5)


def test_errors_are_those_of_the_judged_pixels():
    problem = problem_of("blobs8", 16)
    truth = np.zeros((4, 4))
    image = np.zeros((16, 16, 4))
    image.reshape(-1, 4)[problem.judged[0]] = [0.3, 0, 0, 0.5]
    found = errors_of(problem, image, truth)
    assert found["largest"] == 0.3
    assert found["largest_opacity"] == 0.5
    assert math.isclose(found["rms"], 0.3 / math.sqrt(12))
    assert found["rms_opacity"] == 0.25
    for bad in (image[:8], np.full_like(image, np.nan)):
        with pytest.raises(ValueError, match="image must be finite"):
            errors_of(problem, bad, truth)


def test_a_ladder_ends_where_the_next_rung_takes_too_long_or_a_slow_one_brought_nothing():
    def rungs(*points):
        return [{"seconds": seconds, "rms": rms} for seconds, rms in points]

    assert not too_dear([], 1.0)
    assert too_dear(rungs((1.0, 1e-2), (2.0, 1e-3)), 3.9)
    assert not too_dear(rungs((1.0, 1e-2), (2.0, 1e-3)), 4.1)
    assert too_dear(rungs((1.5, 1e-3), (3.0, 9e-4)), 60.0)
    assert not too_dear(rungs((0.15, 1e-3), (0.3, 9e-4)), 60.0)


# --- the comparison


def test_a_comparison_holds_every_pair_or_says_why_not(figures):
    assert {"format", "format_version", "machine", "date", "packages", "side", "core"} <= figures.keys()
    assert [problem["name"] for problem in figures["problems"]] == ["blobs16", "blobs16+mesh1k"]
    assert all(problem["truth_bound"] <= TOLERANCE for problem in figures["problems"])
    pairs = {(run["problem"], run["renderer"]) for run in figures["runs"]}
    assert len(pairs) == 5
    why = {"renderer": "scipy", "problem": "blobs16+mesh1k", "why": "draws no meshes"}
    assert figures["absent"] == [why]
    for found in figures["runs"]:
        assert {"remark", "preparation", "stopped"} <= found.keys()
        wanted = {"setting", "seconds", "frames", "rms", "largest", "rms_opacity", "largest_opacity"}
        assert found["points"]
        assert all(point.keys() == wanted for point in found["points"])
    assert json.loads(json.dumps(figures)) == figures


def test_a_renderer_that_is_not_installed_is_said(monkeypatch):
    absent = dataclasses.replace(RENDERERS["numba"], needs=("no_such_package",))
    monkeypatch.setitem(RENDERERS, "numba", absent)
    said = []
    found = compare([], ["numba"], say=said.append)
    assert said == ["Numba marcher: not installed: no_such_package"]
    assert found["absent"] == [
        {"renderer": "numba", "problem": None, "why": "not installed: no_such_package"}
    ]
    assert "Left out: Numba marcher: not installed: no_such_package." in side_by_side(found)


def test_a_renderer_that_fails_is_said(monkeypatch):
    broken = Renderer("broken", "a broken one", "volref_methods", "no_such_function")
    monkeypatch.setitem(RENDERERS, "broken", broken)  # the process that is to measure it knows it not
    found = compare(["blobs8"], ["broken"], **SMALL)
    assert found["runs"] == []
    assert found["absent"] == [
        {"renderer": "broken", "problem": "blobs8", "why": "failed: KeyError: 'broken'"}
    ]
    monkeypatch.setattr(comparing, "TIMEOUT", 1e-3)
    assert compare(["blobs8"], ["scipy"], **SMALL)["absent"][0]["why"] == "not done after 0 s"


# --- what the figures say


def test_seconds_to_an_error_do_not_depend_on_the_order_of_the_rungs():
    rungs = [{"seconds": 1.0, "rms": 1e-2}, {"seconds": 100.0, "rms": 1e-4}]
    assert reach(rungs, 1e-3) == reach(rungs[::-1], 1e-3)
    assert math.isclose(reach(rungs, 1e-3).seconds, 10.0)
    assert reach([], 1e-3) == Reached("never", math.inf)


def test_duels_are_won_lost_or_open():
    found = duels(
        made_up(
            run("a", "volref-march", (1.0, 2e-3), (2.0, 1e-4)),
            run("a", "volref-exact", (8.0, 1e-12)),
            run("a", "drjit", (0.5, 2e-3), (1.0, 1e-4), (2.0, 9e-5)),
            run("a", "scipy", (4.0, 2e-3), (9.0, 1e-4), (18.0, 3e-5)),
            run("a", "numba", (4.0, 2e-3), (5.0, 1e-4), (6.0, 2e-5)),
        )
    )
    outcomes = {
        name: [duel.outcome for duel in found if duel.renderer == name]
        for name in ("drjit", "scipy", "numba")
    }
    assert LEVELS == (1e-3, 1e-4, 1e-5, 1e-7)
    assert outcomes["drjit"] == ["lost", "lost", "won", "won"]  # it is on its floor
    assert outcomes["scipy"] == ["won", "won", "won", "won"]  # beyond 18 s, more than volref takes
    assert outcomes["numba"] == ["won", "won", "open", "open"]  # after 6 s it still fell
    by_scipy = next(duel for duel in found if (duel.renderer, duel.level) == ("scipy", 1e-4))
    assert (by_scipy.ratio, by_scipy.certain, by_scipy.ours_by) == (4.5, "=", "volref-march")


def test_the_fastest_of_volrefs_ways_is_one_that_gets_there():
    runs = runs_on(
        made_up(run("a", "volref-march", (1.0, 1e-4)), run("a", "volref-exact", (8.0, 1e-12))), "a"
    )
    assert fastest_of_ours(runs, 1e-3)[0] == "volref-march"
    assert fastest_of_ours(runs, 1e-5)[0] == "volref-exact"
    assert fastest_of_ours(runs, 1e-13) is None


# --- the page


def test_the_section_states_ratios_losses_and_what_only_volref_reaches():
    text = side_by_side(
        made_up(
            run("blobs128", "volref-march", (1.0, 2e-3), (2.0, 4e-4), (4.0, 1e-4)),
            run("blobs128", "volref-exact", (8.0, 1e-12)),
            run("blobs128", "drjit", (0.25, 2e-3), (0.5, 4e-4), (1.0, 1e-4), (2.0, 9e-5)),
            run("blobs128", "vtk-fixed", (6.0, 2e-3), (8.0, 2e-3), (8.0, 3e-3)),
            run("blobs128+mesh20k", "drjit", (0.25, 2e-3), (0.5, 4e-4), (1.0, 3e-4)),
        )
    )
    assert (
        "- to Dr.Jit (LLVM) marcher on `blobs128`: at 1e-3 4.0 times as slow, at 1e-4 4.0 times as slow."
        in text
    )
    assert "| Dr.Jit (LLVM) marcher | 0.34 (0.25) | 1.0 (0.25) | never | never |" in text
    assert "| VTK, fixed-point CPU caster | never | never | never | never |" in text
    assert "| volref, certified | <= 8.0 | <= 8.0 | **<= 8.0** | **<= 8.0** |" in text
    assert "takes 2.0 times as long as volref's faster march: volref wins" in text
    assert "| Dr.Jit (LLVM) marcher | step 1 | 1.0e-04 | 3.0e-04 | 3.0 times |" in text


def test_what_volref_alone_reaches_is_said_only_if_it_is_so():
    alone = "At 1e-7 volref alone gets there"
    exact, other = run("a", "volref-exact", (8.0, 1e-12)), run("a", "drjit", (0.5, 1e-3))
    assert alone in side_by_side(made_up(exact, other))
    assert alone not in side_by_side(made_up(exact, run("a", "drjit", (0.5, 1e-8))))
    assert alone not in side_by_side(made_up(run("a", "volref-march", (8.0, 1e-5)), other))


def test_a_page_is_made_from_a_comparison_with_its_plots(figures, tmp_path):
    write_page({"peers": figures}, tmp_path / "performance.md")
    text = (tmp_path / "performance.md").read_text(encoding="utf-8")
    assert text.startswith("# Performance\n")
    assert "## Side by side" in text
    assert figures["machine"] in text
    for suffix in (".svg", ".png"):
        assert (tmp_path / "images" / f"performance-peers{suffix}").stat().st_size > 10_000
    for section in (
        "Where volref wins, and where it loses",
        "Seconds to an error",
        "At equal step",
        "With a mesh",
    ):
        assert f"### {section}" in text


def test_a_page_without_figures_has_no_sections():
    assert "##" not in performance_page({})


def test_the_page_in_the_docs_is_made_from_the_figures_that_are_kept():
    results = load_results()
    assert PAGE.read_text(encoding="utf-8") == performance_page(results)
    for name in results:
        if SECTIONS[name].plot is not None:
            assert (PAGE.parent / "images" / f"performance-{name}.svg").exists()
            assert (PAGE.parent / "images" / f"performance-{name}.png").exists()


def test_every_renderer_has_a_style_and_every_problem_a_meaning():
    assert STYLES.keys() == RENDERERS.keys()
    assert MEANINGS.keys() == set(PROBLEMS)
    assert len({(color, mark) for color, mark, _ in STYLES.values()}) == len(STYLES)
    assert 1.0 in STEPS
    assert len(OURS) == 4
    assert len(MESH_COLOR) == 3
