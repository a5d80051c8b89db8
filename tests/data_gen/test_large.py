"""The large volume: its values by the formula, and a file that appears whole or not at all."""

import numpy as np
import pytest

import volref as vr
from data_gen.large import main, write_large


def test_each_voxel_has_the_value_of_the_formula(tmp_path):
    write_large(tmp_path / "ball.npy", 36)
    x = (np.arange(36) + 0.5) / 18 - 1
    radius = np.sqrt(x[:, None, None] ** 2 + x[:, None] ** 2 + x**2)
    waves = 127.5 * (1 + np.cos(2 * np.pi * radius / 0.15))
    values = vr.load_volume(tmp_path / "ball.npy").values
    inside = radius < 0.9
    # half for rounding to codes; nothing at 36 a side lies within 1e-9 of the radius
    assert np.abs(values[inside] - waves[inside]).max() <= 0.5 + 1e-9
    assert np.abs(radius - 0.9).min() > 1e-9
    assert not values[~inside].any()
    assert values.any()


def test_layers_of_zeros_are_holes_that_read_as_zeros(tmp_path):
    write_large(tmp_path / "ball.npy", 64)
    values = np.load(tmp_path / "ball.npy")
    assert not values[:3].any()
    assert not values[-3:].any()
    assert (tmp_path / "ball.npy").stat().st_size == 128 + 64**3


def test_progress_ends_at_one(tmp_path):
    told = []
    write_large(tmp_path / "ball.npy", 8, progress=told.append)
    assert told == [k / 8 for k in range(1, 9)]


def test_an_interrupted_run_leaves_nothing(tmp_path):
    def interrupt(part):
        if part > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_large(tmp_path / "ball.npy", 8, progress=interrupt)
    assert list(tmp_path.iterdir()) == []


def test_the_command_writes_once_and_refuses_in_one_sentence(tmp_path, capsys):
    out = str(tmp_path / "ball.npy")
    assert main([out, "--side", "16"]) == 0
    assert capsys.readouterr().out == out + "\n"
    assert main([out, "--side", "16"]) == 2
    assert "must not exist yet" in capsys.readouterr().err
    assert main([out, "--side", "16", "--force"]) == 0
    capsys.readouterr()
    assert main([out, "--side", "15", "--force"]) == 2
    assert capsys.readouterr().err == "data_gen.large: side must be even, got 15; give 16\n"
