"""A folder appears whole or not at all."""

import os
import signal
import subprocess
import sys
import time

import pytest

from volref.errors import FormatError
from volref.io import folders
from volref.io.folders import atomic_folder


class Interrupted(BaseException):
    """Stands for Ctrl-C: not an Exception."""


def write(path, text, **options):
    with atomic_folder(path, **options) as part:
        (part / "a.txt").write_text(text)


def names(folder):
    return sorted(entry.name for entry in folder.iterdir())


def read(folder):
    return (folder / "a.txt").read_text()


def test_a_block_that_ends_well_leaves_the_folder_and_nothing_else(tmp_path):
    write(tmp_path / "deep" / "one", "whole")
    assert names(tmp_path / "deep") == ["one"]
    assert read(tmp_path / "deep" / "one") == "whole"


def test_while_it_is_written_there_is_no_folder_of_that_name(tmp_path):
    with atomic_folder(tmp_path / "one") as part:
        assert not (tmp_path / "one").exists()
        assert part.name.startswith(".one.")


@pytest.mark.parametrize("error", [ValueError, Interrupted])
def test_an_interrupted_block_leaves_the_old_folder_and_nothing_else(tmp_path, error):
    write(tmp_path / "one", "old")

    def broken():
        with atomic_folder(tmp_path / "one", overwrite=True) as part:
            (part / "a.txt").write_text("ha")
            raise error

    with pytest.raises(error):
        broken()
    assert names(tmp_path) == ["one"]
    assert read(tmp_path / "one") == "old"


KILLED = """
import sys, time
from volref.io.folders import atomic_folder
with atomic_folder(sys.argv[1]) as part:
    (part / "a.txt").write_text("half")
    print("written", flush=True)
    time.sleep(60)
"""


def test_a_killed_process_leaves_no_folder_of_that_name_and_the_next_one_is_not_in_its_way(tmp_path):
    child = subprocess.Popen(
        [sys.executable, "-c", KILLED, str(tmp_path / "one")], stdout=subprocess.PIPE, text=True
    )
    with child:
        assert child.stdout.readline() == "written\n"
        child.send_signal(signal.SIGKILL)
    (left,) = names(tmp_path)
    assert left.startswith(".one.")
    write(tmp_path / "one", "whole")
    assert read(tmp_path / "one") == "whole"


def test_what_a_killed_process_left_is_removed_after_a_day_and_not_before(tmp_path):
    mine, other = (tmp_path / f".{name}.{'0' * 32}.part" for name in ("one", "two"))
    for left in (mine, other):
        left.mkdir()
    write(tmp_path / "one", "whole")
    assert mine.exists()
    yesterday = time.time() - folders.STALE_SECONDS - 60
    for left in (mine, other):
        os.utime(left, (yesterday, yesterday))
    write(tmp_path / "one", "again", overwrite=True)
    assert names(tmp_path) == sorted([other.name, "one"])


def test_the_old_folder_comes_back_if_a_crash_fell_between_the_two_renames(tmp_path):
    write(tmp_path / "one", "old")
    (tmp_path / "one").rename(tmp_path / f".one.{'0' * 32}.old")
    with pytest.raises(FormatError, match="must not exist yet"):
        write(tmp_path / "one", "new")
    assert names(tmp_path) == ["one"]
    assert read(tmp_path / "one") == "old"


def test_the_old_folder_stays_if_the_new_one_cannot_be_moved(tmp_path, monkeypatch):
    write(tmp_path / "one", "old")
    rename = type(tmp_path).rename

    def failing(self, target):
        if self.name.endswith(".part"):
            raise PermissionError(13, "Permission denied")
        return rename(self, target)

    monkeypatch.setattr(type(tmp_path), "rename", failing)
    with pytest.raises(FormatError, match="Permission denied"):
        write(tmp_path / "one", "new", overwrite=True)
    assert names(tmp_path) == ["one"]
    assert read(tmp_path / "one") == "old"


def test_an_existing_folder_is_never_replaced_without_being_told(tmp_path):
    write(tmp_path / "one", "old")
    with pytest.raises(FormatError, match=r"must not exist yet.*overwrite=True \(--force\)"):
        write(tmp_path / "one", "new")
    assert read(tmp_path / "one") == "old"
    write(tmp_path / "one", "new", overwrite=True)
    assert read(tmp_path / "one") == "new"
    assert names(tmp_path) == ["one"]


def test_a_folder_of_another_kind_is_not_replaced_when_told(tmp_path):
    write(tmp_path / "one", "old")
    with pytest.raises(FormatError, match="other things in it"):
        write(tmp_path / "one", "new", overwrite=True, replaceable=lambda _: False)
    assert read(tmp_path / "one") == "old"


@pytest.mark.parametrize("overwrite", [False, True])
def test_a_file_or_a_link_in_its_place_is_refused(tmp_path, overwrite):
    (tmp_path / "file").write_text("x")
    (tmp_path / "there").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "there")
    for name in ("file", "link"):
        with pytest.raises(FormatError, match="a file or a link"):
            write(tmp_path / name, "new", overwrite=overwrite)


def test_a_folder_that_appears_meanwhile_is_not_replaced(tmp_path):
    def race():
        with atomic_folder(tmp_path / "one") as part:
            (part / "a.txt").write_text("mine")
            write(tmp_path / "one", "theirs")

    with pytest.raises(FormatError, match="must not exist yet"):
        race()
    assert read(tmp_path / "one") == "theirs"
    assert names(tmp_path) == ["one"]


def test_a_folder_that_appears_at_the_last_moment_is_not_replaced(tmp_path, monkeypatch):
    check, calls = folders._check_place, []

    def slow_check(target, *kinds, **options):
        check(target, *kinds, **options)
        calls.append(target)
        if len(calls) == 2:  # between the look and the rename
            target.mkdir()
            (target / "a.txt").write_text("theirs")

    monkeypatch.setattr(folders, "_check_place", slow_check)
    with pytest.raises(FormatError, match="must not exist yet"):
        write(tmp_path / "one", "mine")
    assert read(tmp_path / "one") == "theirs"
    assert names(tmp_path) == ["one"]


def test_a_place_that_cannot_be_written_is_said(tmp_path):
    (tmp_path / "file").write_text("x")
    with pytest.raises(FormatError, match="must be a folder that can be written"):
        write(tmp_path / "file" / "one", "new")


RIVAL = """
import sys
from volref.errors import FormatError
from volref.io.folders import atomic_folder
path, who, overwrite = sys.argv[1], sys.argv[2], sys.argv[3] == "yes"
print("ready", flush=True)
sys.stdin.readline()
won = 0
for _ in range(40):
    try:
        with atomic_folder(path, overwrite=overwrite) as part:
            for name in ("a.txt", "b.txt"):
                (part / name).write_text(who)
    except FormatError:
        continue
    won += 1
print(won)
"""


@pytest.mark.parametrize("overwrite", ["no", "yes"])
def test_of_two_processes_that_write_one_folder_each_writes_it_whole(tmp_path, overwrite):
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    words = [[sys.executable, "-c", RIVAL, str(tmp_path / "one"), who, overwrite] for who in ("x", "y")]
    rivals = [subprocess.Popen(word, **pipes) for word in words]
    for rival in rivals:
        assert rival.stdout.readline() == "ready\n"
    for rival in rivals:
        rival.stdin.write("go\n")
        rival.stdin.flush()
    won = [int(rival.communicate()[0]) for rival in rivals]
    assert won == [40, 40] if overwrite == "yes" else sum(won) == 1
    assert names(tmp_path) == ["one"]
    written = {file.read_text() for file in (tmp_path / "one").iterdir()}
    assert names(tmp_path / "one") == ["a.txt", "b.txt"]
    assert len(written) == 1, "all of it is of one of them"
