"""A file appears whole or not at all."""

import stat

import pytest

from volref.errors import FormatError
from volref.io import atomic_path


class Interrupted(BaseException):
    """Stands for Ctrl-C: not an Exception."""


def write(path, text, **options):
    with atomic_path(path, **options) as temporary:
        temporary.write_text(text)


def test_a_block_that_ends_well_leaves_the_file_and_nothing_else(tmp_path):
    write(tmp_path / "a.txt", "whole")
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.txt"]
    assert (tmp_path / "a.txt").read_text() == "whole"


@pytest.mark.parametrize("error", [ValueError, Interrupted])
def test_an_interrupted_block_leaves_the_old_file_and_nothing_else(tmp_path, error):
    (tmp_path / "a.txt").write_text("old")

    def broken():
        with atomic_path(tmp_path / "a.txt", overwrite=True) as temporary:
            temporary.write_text("ha")
            raise error

    with pytest.raises(error):
        broken()
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.txt"]
    assert (tmp_path / "a.txt").read_text() == "old"


def test_an_existing_file_is_never_overwritten_without_being_told(tmp_path):
    write(tmp_path / "a.txt", "old")
    with pytest.raises(FormatError, match=r"must not exist yet.*overwrite=True \(--force\)"):
        write(tmp_path / "a.txt", "new")
    assert (tmp_path / "a.txt").read_text() == "old"
    write(tmp_path / "a.txt", "new", overwrite=True)
    assert (tmp_path / "a.txt").read_text() == "new"


def test_a_file_that_appears_meanwhile_is_not_overwritten(tmp_path):
    def race():
        with atomic_path(tmp_path / "a.txt") as temporary:
            temporary.write_text("mine")
            (tmp_path / "a.txt").write_text("theirs")

    with pytest.raises(FormatError, match="must not exist yet"):
        race()
    assert (tmp_path / "a.txt").read_text() == "theirs"


def test_the_temporary_file_keeps_its_suffixes_and_the_users_permissions(tmp_path):
    with atomic_path(tmp_path / "a.nii.gz") as temporary:
        assert temporary.name.endswith(".a.nii.gz")
        assert temporary.parent == tmp_path
        temporary.write_bytes(b"x")
    (tmp_path / "plain").write_bytes(b"x")
    modes = [stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("a.nii.gz", "plain")]
    assert modes[0] == modes[1]


def test_a_folder_that_does_not_exist_is_one_sentence(tmp_path):
    with pytest.raises(FormatError, match="choose a folder that exists"):
        write(tmp_path / "none" / "a.txt", "x")
