"""`volref charts`: the charts as bundles on the disk."""

import json

import numpy as np
import pytest

import volref as vr
from volref.cli import main
from volref.golden.charts import CHARTS
from volref.golden.reading import load_bundle


def run(capsys, *words):
    status = main([str(word) for word in words])
    out, err = capsys.readouterr()
    return status, out, err


def test_without_a_folder_all_charts_are_listed_and_nothing_is_written(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, out, err = run(capsys, "charts")
    assert (status, err) == (0, "")
    assert [line.split()[0] for line in out.splitlines()] == list(CHARTS)
    assert list(tmp_path.iterdir()) == []


def test_a_chart_is_written_as_a_bundle_with_what_a_program_draws_of_it(tmp_path, capsys):
    status, out, _ = run(
        capsys, "charts", tmp_path / "out", "--only", "turned", "--device", "llvmpipe", "--json"
    )
    bundle = load_bundle(tmp_path / "out" / "turned")
    assert status == 0
    assert json.loads(out)["folders"] == [str(tmp_path / "out" / "turned")]
    assert (bundle.name, bundle.title) == ("turned", CHARTS["turned"].title)
    drawn = vr.emulate(CHARTS["turned"].make(), "texture3d", "llvmpipe").rgba
    assert np.array_equal(bundle.acceptance.nominal, drawn)


def test_a_chart_that_is_there_stays_unless_force_is_given(tmp_path, capsys):
    words = ("charts", tmp_path, "--only", "f-shape", "--device", "ideal")
    assert run(capsys, *words)[0] == 0
    status, _, err = run(capsys, *words)
    assert (status, err.count("\n")) == (2, 1)
    assert run(capsys, *words, "--force")[0] == 0


@pytest.mark.parametrize("words", [("--only", "g-shape"), ("--device", "voodoo")])
def test_what_is_unknown_is_refused_in_one_sentence(tmp_path, capsys, words):
    status, _, err = run(capsys, "charts", tmp_path / "out", *words)
    assert (status, err.count("\n")) == (2, 1)
    assert not (tmp_path / "out").exists()
