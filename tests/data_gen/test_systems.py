"""The pictures and figures of the systems: `python -m data_gen.systems`."""

import numpy as np

import volref as vr
from data_gen.systems.__main__ import main
from data_gen.systems.figures import distance
from data_gen.systems.page import page
from data_gen.systems.sheets import PAGES, shown


def test_every_program_without_a_radar_has_a_page():
    named = [name for names in PAGES.values() for name in names]
    assert sorted(named) == sorted(name for name in vr.pipelines() if "radar" not in name)


def test_a_named_page_is_drawn_alone(tmp_path):
    assert main(["texture3d", "--docs", str(tmp_path), "--pixels", "20"]) == 0
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] == ["system-texture3d.png"]


def test_an_unknown_page_is_refused_in_one_sentence(capsys):
    assert main(["nerf"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_the_table_has_a_row_for_each_program():
    off = distance(np.ones((1, 1, 4)), np.zeros((1, 1, 4)))
    text = page({"texture3d": dict.fromkeys(("as it is", "exact targets", "and a fine step"), off)})
    assert "| `texture3d` | 255.00 / 255.0 / 255 | 255.00 / 255.0 / 255 | 255.00 / 255.0 / 255 |" in text


def test_a_target_of_one_channel_is_white_where_it_is_least():
    target = np.array([[[2.0], [np.inf], [4.0]]])
    assert shown(target)[0, :, 1].tolist() == [1.0, 0.0, 0.0]
