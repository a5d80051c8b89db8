"""The sheet of the test charts: `python -m data_gen.charts`."""

import numpy as np

from data_gen.charts import LARGER, canvas, main, picture
from tests.docs.pages import DOCS
from volref.golden.charts import CHARTS
from volref.image import bytes_from_unit


def test_a_picture_is_the_canvas_enlarged():
    image = canvas(CHARTS["f-shape"])
    shown = picture(image)
    assert np.array_equal(shown[1::LARGER, 1::LARGER], bytes_from_unit(image[..., :3]))


def test_the_sheet_in_the_docs_shows_the_charts_as_they_are(tmp_path):
    from PIL import Image

    assert main(["--docs", str(tmp_path)]) == 0
    files = [folder / "images" / "charts.png" for folder in (tmp_path, DOCS)]
    made, shown = (np.asarray(Image.open(file), dtype=int) for file in files)
    assert made.shape == shown.shape
    # one code: exp and pow end in another bit on other processors
    assert np.abs(made - shown).max() <= 1


def test_a_folder_that_is_a_file_is_refused_in_one_sentence(tmp_path, capsys):
    (tmp_path / "images").write_text("")
    assert main(["--docs", str(tmp_path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
