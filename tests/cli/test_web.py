"""`volref web` puts the modules where pages can import them."""

from pathlib import Path

import volref
from volref.cli import main

WEB = Path(volref.__file__).parent / "web"


def test_the_modules_are_copied_whole(tmp_path, capsys):
    assert main(["web", str(tmp_path / "public" / "volref")]) == 0
    names = {module.name for module in WEB.glob("*.js")}
    assert "index.js" in names
    for name in names:
        assert (tmp_path / "public" / "volref" / name).read_bytes() == (WEB / name).read_bytes()
    assert f"wrote {len(names)} modules" in capsys.readouterr().err


def test_modules_import_nothing_that_is_not_copied():
    for module in WEB.glob("*.js"):
        for line in module.read_text(encoding="utf-8").splitlines():
            if line.startswith(("import ", "export {")) and " from " in line:
                assert (WEB / line.split('"')[1]).is_file()


def test_nothing_is_overwritten_without_force(tmp_path, capsys):
    (tmp_path / "index.js").write_text("mine")
    assert main(["web", str(tmp_path)]) == 2
    assert "must not exist yet, got a file that does" in capsys.readouterr().err
    assert [file.name for file in tmp_path.iterdir()] == ["index.js"]
    assert main(["web", str(tmp_path), "--force"]) == 0
    assert (tmp_path / "index.js").read_bytes() == (WEB / "index.js").read_bytes()


def test_a_file_in_place_of_the_folder_is_refused(tmp_path, capsys):
    (tmp_path / "there").write_text("mine")
    assert main(["web", str(tmp_path / "there")]) == 2
    assert "must be a folder, got a file" in capsys.readouterr().err
