"""The suite that comes along: what it covers, and that it is the same today."""

import dataclasses
import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import volref as vr
from data_gen.goldens.scans import SCANS
from tests.docs.pages import DOCS
from tests.golden.bundles import copied, put_array
from volref.golden import verifying
from volref.golden.environment import digits, environment, same_digits
from volref.golden.recipe import digest_of_scene
from volref.golden.suite import Suite, load_hashes, load_suite, save_hashes
from volref.golden.verifying import DIFFERS, EQUAL, WITHIN, verify_bundles, verify_suite
from volref.io.png import read_png, write_png

SYSTEMS = {
    "texture3d",
    "arbelaz2016",
    "congote2012",
    "barbagallo",
    "cej2020",
    "vpt-eam",
    "x3dom",
    "burkalo2022",
}
LARGEST = 100_000


@pytest.fixture(scope="module")
def suite():
    """The built-in suite."""
    return load_suite("volref")


def test_it_has_24_goldens_and_more_of_every_system_and_of_real_data(suite):
    programs = [recipe.document["pipeline"]["name"] for recipe in suite.recipes.values()]
    assert len(suite.recipes) >= 24
    assert set(programs) >= SYSTEMS
    assert set(programs) == set(vr.pipelines())
    real = [
        recipe.document["scene"]["path"]
        for recipe in suite.recipes.values()
        if "path" in recipe.document["scene"]
    ]
    assert {Path(path).stem for path in real} == set(SCANS)
    assert len(real) >= 8


def test_a_golden_takes_at_most_100_kilobytes_of_the_repository(suite):
    hashes = json.loads(suite.hashes_file.read_text(encoding="utf-8"))["goldens"]
    for name, recipe in suite.recipes.items():
        texts = len(json.dumps(recipe.document)) + len(json.dumps(hashes[name]))
        assert texts + suite.preview(name).stat().st_size <= LARGEST, name
    assert all(file.stat().st_size <= LARGEST for file in (suite.file.parent / "scans").iterdir())


def test_it_is_drawn_as_it_was_to_the_bit_or_within_its_intervals(suite):
    problems = [redrawn.message for redrawn in verify_suite(suite) if not redrawn.passed]
    assert not problems, f"{problems}: if that is meant, run python -m data_gen.goldens --rehash"


def test_the_changelog_names_this_suite_under_images_changed(suite):
    text = (DOCS / "changelog.md").read_text(encoding="utf-8")
    newest = re.split(r"^## ", text, flags=re.MULTILINE)[1]
    section = newest.partition("### Images changed")[2].partition("\n### ")[0]
    assert f"suite `{load_hashes(suite).digest[:12]}`" in section, (
        "images of the golden suite changed: say under Images changed which, by how much, and name the suite"
    )


def test_previews_are_there_for_every_golden_and_for_nothing_else(suite):
    folder = suite.preview("any").parent
    assert {file.stem for file in folder.iterdir()} == set(suite.recipes)


def test_the_scans_are_every_so_manieth_sample_of_those_of_the_tests(suite):
    for name, make in SCANS.items():
        shipped, made = vr.load_scene(suite.file.parent / "scans" / f"{name}.json"), make()
        if isinstance(made.volume, vr.Volume):
            assert np.array_equal(shipped.volume.values, made.volume.values), name
            assert shipped.volume.spacing == made.volume.spacing
        else:
            for ours, theirs in zip(shipped.volume.sweeps, made.volume.sweeps, strict=True):
                assert np.array_equal(ours.values, theirs.values, equal_nan=True)


@pytest.fixture
def small(suite, tmp_path):
    """One golden of the suite, in a suite of its own with digests and picture."""
    document = dict(suite.recipes["texture3d-blobs"].document) | {"width": 16, "height": 12}
    del document["truth"]
    head = {"format": "volref-suite", "format_version": 1, "name": "small"}
    (tmp_path / "small.json").write_text(json.dumps(head | {"recipes": [document]}))
    made = load_suite(tmp_path / "small.json")
    rehashed(made)
    return made


def rehashed(suite, **changes):
    """Write digests of now, with other digests for some parts."""
    subjects = {name: verifying.subject_of(recipe) for name, recipe in suite.recipes.items()}
    goldens = {name: verifying.draw_again(subject) | changes for name, subject in subjects.items()}
    for name, subject in subjects.items():
        suite.preview(name).parent.mkdir(exist_ok=True)
        drawn = vr.emulate(subject.scene, subject.pipeline, subject.device)
        write_png(suite.preview(name), drawn.rgba8, overwrite=True)
    return save_hashes(suite, goldens)


def of_another_place(suite: Suite):
    """Let the digests be from a machine whose functions return other digits."""
    document = json.loads(suite.hashes_file.read_text())
    document["environment"]["digits"] = "0" * 64
    suite.hashes_file.write_text(json.dumps(document))


def test_another_digest_in_the_same_place_is_a_difference_and_says_in_which_part(small):
    assert [one.status for one in verify_suite(small)] == [EQUAL]
    rehashed(small, passes="0" * 64)
    (redrawn,) = verify_suite(small)
    assert (redrawn.status, redrawn.changed) == (DIFFERS, ("passes",))
    assert "the same to the bit" in redrawn.message


def test_from_another_place_an_image_has_to_lie_within_the_intervals(small):
    rehashed(small, nominal="0" * 64)
    of_another_place(small)
    assert [one.status for one in verify_suite(small)] == [WITHIN]
    picture = small.preview("texture3d-blobs")
    codes = np.array(read_png(picture))
    codes[6, 8, 3] += 12
    write_png(picture, codes, overwrite=True)
    (redrawn,) = verify_suite(small)
    assert redrawn.status == DIFFERS
    assert "1 pixels lie outside" in redrawn.message


def test_from_another_place_a_picture_of_another_size_is_a_difference(small):
    rehashed(small, nominal="0" * 64)
    of_another_place(small)
    write_png(small.preview("texture3d-blobs"), np.zeros((3, 3, 4), np.uint8), overwrite=True)
    assert [one.status for one in verify_suite(small)] == [DIFFERS]


def test_digests_of_other_goldens_than_the_suite_has_are_refused(small):
    document = json.loads(small.hashes_file.read_text())
    document["goldens"]["stranger"] = document["goldens"]["texture3d-blobs"]
    small.hashes_file.write_text(json.dumps(document))
    with pytest.raises(vr.FormatError, match="'stranger' in one alone"):
        verify_suite(small)


def test_a_process_of_its_own_draws_the_same_bits(small):
    words = [sys.executable, "-m", "volref", "golden", "verify", str(small.file), "--json"]
    out = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    assert [golden["status"] for golden in json.loads(out)["goldens"]] == [EQUAL]


def test_a_bundle_is_drawn_again_from_what_lies_in_it(bundle, tmp_path):
    (redrawn,) = verify_bundles([bundle])
    assert redrawn.status == EQUAL
    lied = copied(bundle, tmp_path / "lied")
    nominal = np.load(lied / "expected/nominal.npy")
    nominal[4, 5] += 40 / 255
    put_array(lied, "expected/nominal.npy", nominal)
    (redrawn,) = verify_bundles([lied])
    assert (redrawn.status, redrawn.changed) == (DIFFERS, ("nominal",))


def test_a_bundle_from_another_place_has_to_lie_within_the_intervals(bundle, tmp_path, monkeypatch):
    monkeypatch.setattr(verifying, "same_digits", lambda _: False)
    lied = copied(bundle, tmp_path / "lied")
    passes = np.load(lied / "passes/01_canvas.npy")
    put_array(lied, "passes/01_canvas.npy", passes + 1e-12)
    assert [one.status for one in verify_bundles([lied])] == [WITHIN]
    nominal = np.load(lied / "expected/nominal.npy")
    put_array(lied, "expected/nominal.npy", nominal + 40 / 255)
    assert [one.status for one in verify_bundles([lied])] == [DIFFERS]


def test_the_probe_of_digits_sees_one_ulp(monkeypatch):
    digits.cache_clear()
    here = environment()
    assert same_digits(here)
    exp = np.exp
    monkeypatch.setattr(np, "exp", lambda x: np.nextafter(exp(x), np.float32(np.inf), dtype=x.dtype))
    digits.cache_clear()
    try:
        assert not same_digits(here)
    finally:
        digits.cache_clear()


def test_an_interval_is_held_too_where_its_digest_is_stated(small):
    recipe = small.recipes["texture3d-blobs"]
    digest = verifying.draw_again(verifying.subject_of(recipe), interval=True)["interval"]
    rehashed(small, interval=digest)
    assert [one.status for one in verify_suite(small)] == [EQUAL]
    rehashed(small, interval="0" * 64)
    assert [one.changed for one in verify_suite(small)] == [("interval",)]


def test_the_digest_of_a_suite_follows_from_its_images_alone(small):
    before = rehashed(small)
    assert rehashed(small, scene="0" * 64, interval="1" * 64).digest == before.digest
    assert rehashed(small, passes="0" * 64).digest != before.digest
    assert dataclasses.replace(before, environment={}).digest == before.digest


def test_scans_have_the_digests_that_recipes_state(suite):
    for recipe in suite.recipes.values():
        source = recipe.document["scene"]
        if "path" in source:
            assert digest_of_scene(recipe.folder / source["path"]) == source["sha256"], recipe.name
