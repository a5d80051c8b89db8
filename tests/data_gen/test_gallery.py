"""The gallery: its command on tiny pictures, its page, and the images and credits that the page names."""

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from data_gen.gallery.__main__ import main
from data_gen.gallery.catalogue import CREDITS, SHEETS
from data_gen.gallery.radars import BANDS, maps
from data_gen.gallery.scans import CT, STENT, scan, seen_from
from data_gen.gallery.sheets import GAP, LABEL, MARGIN, Settings, Tile, contact_sheet, error_of, write_sheet
from volref.phantoms.transfer import dbz_transfer

ROOT = Path(__file__).parents[2]
DATA, PAGE = ROOT / "tests" / "data", ROOT / "docs" / "gallery.md"
MOST_BYTES, MOST_BYTES_TOGETHER = 250_000, 1_500_000


def named_images(text):
    return re.findall(r"!\[[^\]]*\]\(images/([^)]+)\)", text)


@pytest.mark.parametrize("sheet", SHEETS, ids=lambda sheet: sheet.name)
def test_each_sheet_draws_its_first_pictures(sheet, tmp_path, capsys):
    docs = tmp_path / "docs"
    tiny = ["--data", str(DATA), "--docs", str(docs), "--first", "1", "--scale", "0.06"]
    assert main([sheet.name, *tiny]) == 0
    assert sheet.name in capsys.readouterr().err
    assert [path.name for path in (docs / "images").iterdir()] == [sheet.file]
    with Image.open(docs / "images" / sheet.file) as image:
        colors = np.asarray(image.convert("RGB"))[MARGIN + LABEL :]
    assert len(np.unique(colors.reshape(-1, 3), axis=0)) > 2
    assert not (docs / "gallery.md").exists()


def test_without_names_the_page_is_written_too(tmp_path, monkeypatch):
    def one(_):
        yield Tile("dot", np.zeros((2, 2, 3), np.uint8), np.array([[0.25]]), "certified")

    few = [type(sheet)(**{**vars(sheet), "tiles": one}) for sheet in SHEETS]
    monkeypatch.setattr("data_gen.gallery.__main__.SHEETS", few)
    assert main(["--data", str(DATA), "--docs", str(tmp_path)]) == 0
    text = (tmp_path / "gallery.md").read_text(encoding="utf-8")
    assert sorted(named_images(text)) == sorted(path.name for path in (tmp_path / "images").iterdir())
    assert text.count("Certified (1 picture): no channel off by more than 0.25.") == len(SHEETS)


def test_an_unknown_name_and_a_missing_file_are_refused_in_a_sentence(tmp_path, capsys):
    assert main(["moods"]) == 2
    assert "got 'moods'" in capsys.readouterr().err
    assert main(["radar", "--data", str(tmp_path), "--docs", str(tmp_path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_the_page_names_exactly_the_images_that_exist():
    there = sorted(path.name for path in (ROOT / "docs" / "images").glob("gallery-*"))
    assert sorted(named_images(PAGE.read_text(encoding="utf-8"))) == there
    assert there == sorted(sheet.file for sheet in SHEETS)


def test_the_images_are_small():
    sizes = [path.stat().st_size for path in (ROOT / "docs" / "images").glob("gallery-*")]
    assert max(sizes) <= MOST_BYTES
    assert sum(sizes) <= MOST_BYTES_TOGETHER


def test_each_file_used_is_credited_on_the_page_and_in_the_notices():
    text, notices = PAGE.read_text(encoding="utf-8"), (DATA / "README.md").read_text(encoding="utf-8")
    for name in {name for sheet in SHEETS for name in sheet.files}:
        assert f"| `{name}` | {CREDITS[name]} |" in text
        row = next(line for line in notices.splitlines() if line.startswith(f"| `{name}`"))
        licence = re.search(r"BSD-3-Clause|MIT|MNI notice|CC BY 4.0", CREDITS[name])
        assert licence is not None
        assert licence.group() in row


def test_a_sheet_has_each_tile_where_its_row_and_column_are():
    tiles = [Tile("", np.full((4, width, 3), code, np.uint8)) for width, code in ((6, 50), (8, 60), (5, 70))]
    sheet = contact_sheet(tiles, columns=2)
    row = 4 + LABEL + GAP
    assert sheet.shape == (2 * row + MARGIN, 6 + 8 + 2 * GAP + MARGIN, 3)
    assert (sheet[MARGIN + LABEL :][:4, MARGIN:][:, :6] == 50).all()
    assert (sheet[MARGIN + LABEL :][:4, MARGIN + 6 + GAP :][:, :8] == 60).all()
    assert (sheet[MARGIN + LABEL + row :][:4, MARGIN:][:, :5] == 70).all()


def test_a_palette_keeps_a_rare_hue(tmp_path):
    shades = np.repeat(np.arange(256, dtype=np.uint8)[:, None, None], 3, axis=2) * np.ones(
        (1, 64, 1), np.uint8
    )
    shades[100:110, 10:20] = (255, 90, 0)
    write_sheet(tmp_path / "few.png", shades, palette=True)
    with Image.open(tmp_path / "few.png") as image:
        assert image.mode == "P"
        kept = np.asarray(image.convert("RGB")).astype(int)[105, 15]
    # A cube of 256 colours has sides of 6 levels: half of 255 / 6.
    assert np.abs(kept - (255, 90, 0)).max() <= 22


def test_errors_of_pixels_that_show_nothing_do_not_count():
    flat = np.zeros((1, 4, 3), np.uint8)
    bound = np.array([[0.0, 1e-13, 0.5, 0.5]])
    assert "half of the pixels that show anything off by less than 0.5," in error_of(
        [Tile("a", flat, bound, "estimate")]
    )


def test_the_front_of_a_scan_faces_the_camera_with_the_head_up():
    camera = seen_from(scan(DATA / CT))
    right, up, back = camera.view_from_world[:3, :3]
    # Rotations of one axis: products with 0 and 1, and a rounded cosine.
    np.testing.assert_allclose(right, (-1, 0, 0), atol=1e-15)
    np.testing.assert_allclose(up, (0, 0, 1), atol=1e-15)
    np.testing.assert_allclose(back, (0, 1, 0), atol=1e-15)
    assert seen_from(scan(DATA / STENT), 180).view_from_world[2, 1] < 0


def test_the_bar_of_a_radar_map_has_the_colours_of_the_bands_from_below_up():
    *_, bar = maps(Settings(DATA, 85))
    strip = bar.picture[10:-10, 10]
    assert len(strip) == 10 * len(BANDS)
    table = dbz_transfer()
    for dbz, color in zip(BANDS, strip[-5::-10], strict=True):
        at = int(np.searchsorted(table.values, dbz + 2.5)) - 1
        assert color.tolist() == np.rint(255 * table.colors[at]).tolist()
    assert strip[-5].tolist() == [4, 233, 231]
    assert strip[5].tolist() == [253, 253, 253]
