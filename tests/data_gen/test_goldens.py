"""The golden suite is made by one command: `python -m data_gen.goldens`."""

import json
import shutil

import numpy as np
import pytest

import volref as vr
from data_gen.goldens import __main__ as command
from data_gen.goldens.scans import CT_STEP, every, write_scans
from volref.golden.recipe import subject_of
from volref.golden.suite import load_hashes, load_suite
from volref.io.png import read_png


@pytest.fixture
def suite(tmp_path, monkeypatch):
    """A copy of the suite with one small golden, in the place of the real one."""
    document = json.loads(load_suite("volref").file.read_text(encoding="utf-8"))
    recipe = next(recipe for recipe in document["recipes"] if recipe["name"] == "x3dom-shells")
    document["recipes"] = [recipe | {"width": 12, "height": 9}]
    (tmp_path / "volref.json").write_text(json.dumps(document))
    made = load_suite(tmp_path / "volref.json")
    monkeypatch.setattr(command, "load_suite", lambda _: made)
    return made


def test_out_gets_the_bundles_of_the_suite(suite, tmp_path, capsys):
    assert command.main([str(tmp_path / "out")]) == 0
    assert list(suite.recipes) == [vr.load_bundle(tmp_path / "out" / "x3dom-shells").name]
    assert "made" in capsys.readouterr().out
    assert command.main([str(tmp_path / "out"), "x3dom-shells"]) == 0
    assert "kept" in capsys.readouterr().out


def test_rehash_writes_digests_and_pictures_and_says_what_the_changelog_has_to_name(suite, capsys):
    stale = suite.preview("gone")
    stale.parent.mkdir()
    stale.write_bytes(b"")
    assert command.main(["--rehash"]) == 0
    hashes = load_hashes(suite)
    assert hashes.digest[:12] in capsys.readouterr().out
    assert hashes.goldens["x3dom-shells"]["interval"] is None
    subject = subject_of(suite.recipes["x3dom-shells"])
    drawn = vr.emulate(subject.scene, subject.pipeline, subject.device)
    assert np.array_equal(read_png(suite.preview("x3dom-shells")), drawn.rgba8)
    assert not stale.exists()
    assert command.main(["--rehash", "--intervals"]) == 0
    assert load_hashes(suite).goldens["x3dom-shells"]["interval"] is not None


@pytest.mark.usefixtures("suite")
@pytest.mark.parametrize("words", [[], ["out", "nobody"]])
def test_bad_use_is_refused_in_one_sentence(tmp_path, monkeypatch, capsys, words):
    monkeypatch.chdir(tmp_path)
    assert command.main(words) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_scans_are_written_again_as_they_are(tmp_path):
    written, shipped = tmp_path / "scans", load_suite("volref").file.parent / "scans"
    shutil.copytree(shipped, written)
    write_scans(written)
    assert sorted(file.name for file in written.iterdir()) == sorted(file.name for file in shipped.iterdir())
    for file in shipped.glob("*.json"):
        ours, theirs = (json.loads((folder / file.name).read_text()) for folder in (written, shipped))
        # The last digits of a camera's matrix are the machine's.
        assert {**ours, "camera": None} == {**theirs, "camera": None}


def test_every_so_manieth_sample_stays_where_it_was():
    values = np.arange(15 * 14 * 16).reshape(16, 14, 15)
    volume = vr.Volume(values, spacing=(1.0, 2.0, 3.0), origin=(5.0, 6.0, 7.0))
    few = every(volume, CT_STEP)
    assert few.values[1, 1, 1] == values[2, 7, 7]
    # Small whole numbers: exact.
    assert np.array_equal(few.world_from_index @ [1, 1, 1, 1], volume.world_from_index @ [7, 7, 2, 1])
