"""Echoes carried along, written as a series that the command line plays."""

import json

import numpy as np

import volref as vr
from data_gen.moving import main
from volref.cli import main as volref


def write_radar(path):
    """A radar with one strong echo, 10 to 14 km to the east."""
    values = np.full((36, 20), -np.inf)
    values[8:10, 10:14] = 50.0
    sweeps = [vr.Sweep(np.arange(5.0, 360, 10), e, values, 500, 1000) for e in (1.0, 4.0, 8.0)]
    vr.save_radar(vr.RadarVolume(sweeps), path)


def test_echoes_move_with_the_wind_and_play_as_a_series(tmp_path):
    write_radar(tmp_path / "storm.npz")
    words = [str(tmp_path / "storm.npz"), str(tmp_path / "scans"), "--wind", "-20", "0", "--count", "3"]
    assert main(words) == 0
    files = sorted((tmp_path / "scans").iterdir())
    assert [file.name for file in files] == ["storm_00.npz", "storm_01.npz", "storm_02.npz"]
    middle = []
    for file in files:
        strong = vr.ppi(vr.load_radar(file), 0, 80)
        x = np.nonzero(np.where(strong.seen, strong.values, -99) > 30)[1]
        middle.append(x.mean() * 2 * 20.0 / 80)  # km: the map is twice 20 km wide
    # 300 s at 20 m/s to the west: 6 km, on gates of 1 km and pixels of half a kilometre
    assert np.abs(np.diff(middle) + 6).max() < 1
    scene = {
        "format": "volref-scene",
        "format_version": 1,
        "width": 16,
        "height": 12,
        "camera": {
            "kind": "orthographic",
            "eye": [0, -5e4, 2e4],
            "target": [0, 0, 1000],
            "up": [0, 0, 1],
            "height": 3e4,
            "near": 0,
            "far": 2e5,
        },
        "radar": {"path": "storm.npz"},
        "transfer": {"values": [0, 50], "colors": [[0, 0, 1], [1, 0, 0]], "extinction": [0, 0.01]},
    }
    (tmp_path / "scene.json").write_text(json.dumps(scene))
    frames = ["--series", str(tmp_path / "scans"), "-o", str(tmp_path / "frame_%02d.png")]
    assert volref(["render", str(tmp_path / "scene.json"), "--allow-estimate", *frames]) in (0, 1)
    assert len(list(tmp_path.glob("frame_*.png"))) == 3


def test_a_file_that_is_there_is_kept(tmp_path, capsys):
    write_radar(tmp_path / "storm.npz")
    words = [str(tmp_path / "storm.npz"), str(tmp_path), "--count", "1"]
    assert main(words) == 0
    assert main(words) == 2
    assert "storm_00.npz" in capsys.readouterr().err
    assert main([*words, "--force"]) == 0
