"""Goldens of many recipes: over any executor, kept if they are there, and no clash of two runs."""

import json
import multiprocessing
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path

import pytest

import volref as vr
from tests.golden.bundles import contents_of
from volref.golden.making import make_goldens
from volref.golden.suite import load_suite

SUITE = {
    "format": "volref-suite",
    "format_version": 1,
    "name": "two",
    "recipes": [
        {
            "format": "volref-recipe",
            "format_version": 1,
            "name": name,
            "scene": {"specimen": "blobs", "opacity": opacity},
            "width": 8,
            "height": 6,
            "pipeline": {"name": "x3dom"},
        }
        for name, opacity in (("one", 1.0), ("two", 0.5))
    ],
}


@pytest.fixture
def suite(tmp_path):
    """A suite of two goldens of a few pixels."""
    (tmp_path / "two.json").write_text(json.dumps(SUITE))
    return load_suite(tmp_path / "two.json")


def states(made):
    return [(one.name, one.state) for one in made]


def test_each_recipe_gives_a_bundle_of_its_name_that_keeps_the_recipe(suite, tmp_path):
    made = make_goldens(suite.recipes.values(), tmp_path / "out")
    assert states(made) == [("one", "made"), ("two", "made")]
    assert vr.load_bundle(made[1].folder).manifest["recipe"] == SUITE["recipes"][1]
    assert sorted(entry.name for entry in (tmp_path / "out").iterdir()) == ["one", "two"]


def test_a_run_goes_on_where_another_one_stopped(suite, tmp_path):
    make_goldens([suite.recipes["two"]], tmp_path)
    before = (tmp_path / "two/manifest.json").stat().st_ino
    assert states(make_goldens(suite.recipes.values(), tmp_path)) == [("one", "made"), ("two", "kept")]
    assert (tmp_path / "two/manifest.json").stat().st_ino == before


def test_a_golden_of_another_recipe_is_neither_kept_nor_replaced_without_being_told(suite, tmp_path):
    make_goldens([suite.recipes["two"]], tmp_path)
    (tmp_path / "two").rename(tmp_path / "one")
    before = contents_of(tmp_path / "one")
    with pytest.raises(vr.FormatError, match="must not exist yet"):
        make_goldens([suite.recipes["one"]], tmp_path)
    assert contents_of(tmp_path / "one") == before
    assert states(make_goldens([suite.recipes["one"]], tmp_path, overwrite=True)) == [("one", "made")]
    assert contents_of(tmp_path / "one") != before


def test_a_damaged_golden_is_not_taken_for_one(suite, tmp_path):
    make_goldens([suite.recipes["one"]], tmp_path)
    (tmp_path / "one/expected/lo.npy").write_bytes(b"")
    with pytest.raises(vr.FormatError, match="make the bundle again"):
        make_goldens([suite.recipes["one"]], tmp_path)


def test_threads_and_processes_make_the_same_bytes_and_report_progress(suite, tmp_path):
    here = tmp_path / "here"
    make_goldens(suite.recipes.values(), here)
    context = multiprocessing.get_context("spawn")
    with ThreadPoolExecutor(2) as threads, ProcessPoolExecutor(1, mp_context=context) as processes:
        for name, executor in (("threads", threads), ("processes", processes)):
            seen = []
            make_goldens(
                suite.recipes.values(),
                tmp_path / name,
                executor=executor,
                progress=lambda *counts, seen=seen: seen.append(counts),
            )
            assert contents_of(tmp_path / name) == contents_of(here)
            assert seen == [(1, 2), (2, 2)]


def test_an_error_in_a_worker_is_raised_here(suite, tmp_path):
    (tmp_path / "out").write_text("a file")
    with ThreadPoolExecutor(2) as threads, pytest.raises(vr.FormatError):
        make_goldens(suite.recipes.values(), tmp_path / "out", executor=threads)


def test_two_processes_that_make_one_suite_into_one_folder_both_end_well(suite, tmp_path):
    words = [
        sys.executable,
        "-m",
        "volref",
        "golden",
        "make",
        str(suite.file),
        str(tmp_path / "out"),
        "--json",
    ]
    runs = [subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) for _ in range(2)]
    outputs = [run.communicate() for run in runs]
    assert [run.returncode for run in runs] == [0, 0], outputs
    found = [json.loads(out)["goldens"] for out, _ in outputs]
    for entries in zip(*found, strict=True):
        assert sorted(entry["state"] for entry in entries) in (["kept", "made"], ["kept", "kept"])
        vr.load_bundle(Path(entries[0]["folder"]))
    assert sorted(entry.name for entry in (tmp_path / "out").iterdir()) == ["one", "two"]


def test_a_suite_names_recipes_or_their_files_each_once(tmp_path):
    (tmp_path / "one.json").write_text(json.dumps(SUITE["recipes"][0]))
    document = SUITE | {"recipes": ["one.json", SUITE["recipes"][1]]}
    (tmp_path / "mixed.json").write_text(json.dumps(document))
    assert list(load_suite(tmp_path / "mixed.json").recipes) == ["one", "two"]
    (tmp_path / "mixed.json").write_text(json.dumps(document | {"recipes": ["one.json", "one.json"]}))
    with pytest.raises(vr.FormatError, match="got 'one' twice"):
        load_suite(tmp_path / "mixed.json")


@pytest.mark.parametrize("recipes", [[], {}, [1], ["../one.json"], ["none.json"]])
def test_a_suite_that_is_none_is_refused_in_one_sentence(tmp_path, recipes):
    (tmp_path / "bad.json").write_text(json.dumps(SUITE | {"recipes": recipes}))
    with pytest.raises(vr.FormatError) as caught:
        load_suite(tmp_path / "bad.json")
    assert "\n" not in str(caught.value)
