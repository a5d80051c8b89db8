"""Any bytes at all: a reader returns a record or refuses; no other exception, whatever the file holds."""

import gzip
from contextlib import suppress

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tests.bad_files import LOADERS
from tests.io.fuzz import MOST_MEMORY, Reader, fuzz, table
from tests.sound_files import PLAIN, SOUND
from volref.errors import FormatError, SceneError


def _bytes_written(folder, name, write):
    write(folder / name)
    return (folder / name).read_bytes()


@st.composite
def damages(draw):
    """Draw what is done to the bytes of a file: cut it short, change bytes, insert, or replace it all."""
    way = draw(st.sampled_from(["cut", "change", "insert", "replace"]))
    return way, draw(st.floats(0, 1, exclude_max=True)), draw(st.binary(min_size=1, max_size=12))


def damaged(data, damage):
    way, where, noise = damage
    at = int(where * len(data))
    if way == "cut":
        return data[:at]
    if way == "replace":
        return noise
    return data[:at] + noise + data[at + (len(noise) if way == "change" else 0) :]


@pytest.fixture(scope="module")
def valid(tmp_path_factory):
    folder = tmp_path_factory.mktemp("valid")
    return {name: _bytes_written(folder, name, write) for name, (_, _, write) in PLAIN.items()}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("fuzz")


@pytest.mark.parametrize("name", PLAIN)
def test_the_file_before_it_is_damaged_is_read(valid, folder, name):
    kind, statement, _ = PLAIN[name]
    (folder / name).write_bytes(valid[name])
    LOADERS[kind](folder / name, **statement)


@pytest.mark.filterwarnings("default")  # libraries warn of what they find; what counts here is what is raised
@pytest.mark.parametrize("name", PLAIN)
@given(damages())
@example(("replace", 0.0, b"\0" * 12))
@example(("cut", 0.5, b"x"))
@example(("cut", 0.99, b"x"))
def test_a_damaged_file_is_read_or_refused(valid, folder, name, damage):
    kind, statement, _ = PLAIN[name]
    (folder / name).write_bytes(damaged(valid[name], damage))
    limit = {} if kind == "transfer" else {"max_bytes": 2**24}
    with suppress(FormatError, SceneError):
        LOADERS[kind](folder / name, **statement, **limit)


@pytest.mark.filterwarnings("default")
@given(damages())
def test_a_damaged_nifti_inside_a_sound_gzip_is_read_or_refused(valid, folder, damage):
    packed = gzip.compress(damaged(valid["a.nii"], damage))
    (folder / "b.nii.gz").write_bytes(packed)
    with suppress(FormatError, SceneError):
        LOADERS["volume"](folder / "b.nii.gz", max_bytes=2**24)


def test_damaged_files_of_every_format_are_read_or_refused_in_bounded_time_and_memory(tmp_path):
    """A part of `python -m tests.io.fuzz`, whose figures are in docs/guide/files.md."""
    findings = fuzz(tmp_path, SOUND, 5)
    assert not any(found.faults for found in findings.values()), table(findings)
    assert all(found.read + found.refused == 5 for found in findings.values())


def test_a_reader_that_does_wrong_is_found_and_the_next_file_is_read(tmp_path):
    (tmp_path / "a.npy").write_bytes(b"x")
    with Reader() as reader:
        assert reader.read("hog", {}, tmp_path)["memory"] > MOST_MEMORY
        assert reader.read("raise", {}, tmp_path)["became"].startswith("raised ValueError")
        assert reader.read("raise", {}, tmp_path)["memory"] < MOST_MEMORY
        assert reader.read("abort", {}, tmp_path)["became"] == "killed the process (-6)"
        assert reader.read("volume", {}, tmp_path / "a.npy")["became"] == "refused"


@pytest.mark.slow
def test_a_reader_that_hangs_is_found(tmp_path):
    with Reader() as reader:
        assert reader.read("hang", {}, tmp_path)["became"] == "hung for 5.0 s"
