"""The page of faults: `python -m data_gen.faults`; its figures are held by tests/golden/test_confusion.py."""

import shutil

from data_gen.faults.__main__ import main
from tests.docs.pages import DOCS


def test_the_page_alone_is_written_from_figures_that_are_there(tmp_path):
    shutil.copy(DOCS / "faults.json", tmp_path)
    assert main(["--page", "--docs", str(tmp_path)]) == 0
    assert (tmp_path / "faults.md").read_text() == (DOCS / "faults.md").read_text(encoding="utf-8")
    assert (tmp_path / "images" / "faults-confusion.png").is_file()


def test_without_figures_the_page_is_refused_in_one_sentence(tmp_path, capsys):
    assert main(["--page", "--docs", str(tmp_path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
