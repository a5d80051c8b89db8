"""`volref render --verify N`."""

import json

from volref.cli import main


def run(capsys, *words):
    status = main([str(word) for word in words])
    out, err = capsys.readouterr()
    return status, out, err


def test_the_verification_is_said_on_stderr_and_in_the_json(scene_file, tmp_path, capsys):
    words = ("render", scene_file, "-o", tmp_path / "image.npy", "--tolerance", "1", "--verify", "3")
    status, out, err = run(capsys, *words, "--json")
    found = json.loads(out)["verification"]
    assert status == 0
    assert (found["ok"], found["rays"], len(found["pixels"])) == (True, 3, 3)
    assert "volref: verified 3 rays at 30 digits in " in err
    status, out, err = run(capsys, *words, "--quiet", "-f")
    assert (status, out, err) == (0, "", "")


def test_a_ray_outside_its_bound_is_status_1(scene_file, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("volref.truth.verification.Verification.ok", False)
    words = ("render", scene_file, "-o", tmp_path / "image.npy", "--tolerance", "1", "--verify", "1")
    status, _, err = run(capsys, *words, "--quiet")
    assert status == 1
    assert err.startswith("volref: verified 1 ray at 30 digits in ")


def test_a_count_that_is_none_is_refused(scene_file, tmp_path, capsys):
    words = ("render", scene_file, "-o", tmp_path / "image.npy", "--tolerance", "1", "--verify", "0")
    status, _, err = run(capsys, *words)
    assert status == 2
    assert "rays must be a whole number from 1 to 2147483648, got 0; change it" in err
