"""The examples of a page run in a folder of their own, which holds the files that the page shows."""

from pathlib import Path

import pytest

from tests.docs.pages import captioned_files

# It is for Sphinx, which the tests do not need.
collect_ignore = ["conf.py"]


@pytest.fixture(autouse=True)
def _own_folder(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name, text in captioned_files(request.node.path).items():
        Path(name).write_text(text, encoding="utf-8")
