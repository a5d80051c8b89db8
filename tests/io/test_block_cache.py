"""Ranges of blocks beside a file: used where they fit, made anew where not, and never in the way."""

import os
import subprocess
import sys
import zipfile

import numpy as np
import pytest

from volref.io import block_cache, describe_file, load_raw, load_volume
from volref.io.block_cache import cache_path
from volref.scene import blocks
from volref.scene.blocks import block_ranges

REACHES = [(0, 0, 0), (2, 2, 2), (1, 0, 3)]


@pytest.fixture(autouse=True)
def every_volume_is_large(monkeypatch):
    monkeypatch.setattr(block_cache, "MOST_WITHOUT", 0)
    monkeypatch.setattr(blocks, "MOST_FOR_SMALL", 0)
    monkeypatch.delenv(block_cache.SWITCH, raising=False)


@pytest.fixture
def passes(monkeypatch):
    """The passes over voxels that were made."""
    made, reduced = [], blocks._reduced

    def counted(ranges, windows):
        if ranges[0] is ranges[1]:
            made.append(windows)
        return reduced(ranges, windows)

    monkeypatch.setattr(blocks, "_reduced", counted)
    return made


def voxels(seed=0, dtype=np.int16):
    return np.random.default_rng(seed).normal(0, 100, (30, 31, 32)).astype(dtype)


@pytest.fixture
def file(tmp_path):
    np.save(tmp_path / "scan.npy", voxels())
    return tmp_path / "scan.npy"


def ranges_of(file, reach=(0, 0, 0)):
    return block_ranges(load_volume(file), 4, reach)


def assert_right(file, values, reach=(0, 0, 0)):
    """The ranges of the file, whatever lies beside it, are those of the values."""
    volume = load_volume(file)
    assert volume.value_bounds == (values.min(), values.max())
    for got, want in zip(
        block_ranges(volume, 4, reach), block_ranges(blocks.Volume(values), 4, reach), strict=True
    ):
        assert np.array_equal(got, want)


def test_the_second_time_no_voxel_is_looked_at(file, passes, monkeypatch):
    for reach in REACHES:
        ranges_of(file, reach)
    assert len(passes) == 3
    assert [path.name for path in file.parent.iterdir() if path != file] == ["scan.npy.volref-blocks"]
    volume = load_volume(file)
    monkeypatch.setattr("volref.scene.volume._least_and_greatest", None)
    assert volume.value_bounds == (voxels().min(), voxels().max())
    got = [block_ranges(volume, 4, reach) for reach in REACHES]
    assert len(passes) == 3
    for reach, pair in zip(REACHES, got, strict=True):
        for have, want in zip(pair, block_ranges(blocks.Volume(voxels()), 4, reach), strict=True):
            assert np.array_equal(have, want)


@pytest.mark.parametrize("dtype", [np.uint8, np.float32, np.float64])
def test_what_is_kept_is_what_a_pass_makes_in_any_type_and_order(tmp_path, passes, dtype):
    values = voxels(dtype=dtype)
    for name, array in (("c.npy", values), ("f.npy", np.asfortranarray(values))):
        np.save(tmp_path / name, array)
        ranges_of(tmp_path / name)
        before = len(passes)
        assert_right(tmp_path / name, values)
        assert len(passes) == before + 1  # that of the array in memory


def test_raw_files_have_their_ranges_kept_too(tmp_path, passes):
    voxels().tofile(tmp_path / "scan.raw")
    about = ((32, 31, 30), "int16", "little", 0, (1, 1, 1))
    for _ in range(2):
        block_ranges(load_raw(tmp_path / "scan.raw", *about), 4, (0, 0, 0))
    assert len(passes) == 1


def changed_voxels(file):
    np.save(file, voxels(seed=1))


def changed_voxels_at_the_same_time(file):
    state = file.stat()
    np.save(file, voxels(seed=1))
    os.utime(file, ns=(state.st_atime_ns, state.st_mtime_ns))


def another_shape_at_the_same_time(file):
    state = file.stat()
    np.save(file, voxels().reshape(31, 30, 32))
    os.utime(file, ns=(state.st_atime_ns, state.st_mtime_ns))


def another_type_at_the_same_time(file):
    state = file.stat()
    np.save(file, voxels().view(np.uint16))
    os.utime(file, ns=(state.st_atime_ns, state.st_mtime_ns))


@pytest.mark.parametrize(
    "change",
    [
        changed_voxels,
        changed_voxels_at_the_same_time,
        another_shape_at_the_same_time,
        another_type_at_the_same_time,
    ],
)
def test_a_file_that_changed_has_its_ranges_made_anew(file, change, passes):
    ranges_of(file)
    change(file)
    values = np.load(file)
    assert_right(file, values)
    before = len(passes)
    assert_right(file, values)
    assert len(passes) == before + 1  # that of the array in memory: the file is read again from then on


def test_a_changed_time_alone_is_a_change(file, passes):
    ranges_of(file)
    os.utime(file, ns=(1, 1))
    ranges_of(file)
    assert len(passes) == 2


LEAST = "least 4 0 0 0"
DAMAGES = {
    "empty": lambda path: path.write_bytes(b""),
    "not an archive": lambda path: path.write_bytes(b"volref" * 1000),
    "cut short": lambda path: path.write_bytes(path.read_bytes()[:-1000]),
    "flipped bits": lambda path: path.write_bytes(flipped(path.read_bytes())),
    "another key": lambda path: replaced(path, "key", np.array("mine")),
    "a key of numbers": lambda path: replaced(path, "key", np.zeros(3)),
    "a long key": lambda path: replaced(path, "key", np.array("x" * 100_000)),
    "a pickled key": lambda path: replaced(path, "key", np.array({}, dtype=object)),
    "another shape": lambda path: replaced(path, LEAST, np.full((8, 8, 1), -30_000, np.int16)),
    "another type": lambda path: replaced(path, LEAST, np.full((8, 8, 8), -100, np.int8)),
    "a larger type": lambda path: replaced(path, LEAST, np.zeros((8, 8, 8), np.int32)),
    "far too large": lambda path: replaced(path, LEAST, np.zeros((8, 8, 800), np.int16)),
    "pickled": lambda path: replaced(path, LEAST, np.full((8, 8, 8), None)),
    "least above greatest": lambda path: replaced(path, LEAST, np.full((8, 8, 8), 30_000, np.int16)),
    "missing": lambda path: replaced(path, LEAST, None),
    "compressed": lambda path: compressed(path),
    "a folder": lambda path: (path.unlink(), path.mkdir()),
}


def flipped(content):
    middle = len(content) // 3
    return (
        content[:middle]
        + bytes(255 - byte for byte in content[middle : middle + 20])
        + content[middle + 20 :]
    )


def replaced(path, name, array):
    with np.load(path) as archive:
        assert name in archive
        arrays = {each: archive[each] for each in archive} | {name: array}
    with path.open("wb") as stream:
        np.savez(stream, **{each: value for each, value in arrays.items() if value is not None})


def compressed(path):
    with np.load(path) as archive, path.with_name("other").open("wb") as stream:
        np.savez_compressed(stream, **{name: archive[name] for name in archive})
    path.with_name("other").replace(path)


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_file_is_ignored_and_written_anew(file, damage, passes):
    ranges_of(file)
    DAMAGES[damage](cache_path(file))
    assert_right(file, voxels())
    block_ranges(load_volume(file), 4, (2, 2, 2))
    assert_right(file, voxels(), (2, 2, 2))
    before = len(passes)
    for reach in ((0, 0, 0), (2, 2, 2)):
        ranges_of(file, reach)
    # Into a folder nothing is written; what is compressed is read, but not written again.
    assert len(passes) == before or damage in ("a folder", "compressed")


@pytest.mark.parametrize(
    "bounds", [np.array([5.0, -5.0]), np.array([0.0, np.nan]), np.zeros(3), np.array("a")]
)
def test_value_bounds_that_cannot_be_are_ignored(file, bounds):
    ranges_of(file)
    replaced(cache_path(file), "value_bounds", bounds)
    assert_right(file, voxels())


def test_no_more_passes_are_kept_than_a_volume_keeps(file):
    for reach in range(6):
        ranges_of(file, (0, reach % 4, reach // 4))
    with zipfile.ZipFile(cache_path(file)) as archive:
        names = [name for name in archive.namelist() if name.startswith("least")]
    assert len(names) == blocks.MOST_KEPT
    assert "least 4 1 1 0.npy" in names


def test_a_file_that_changes_while_it_is_mapped_leaves_nothing_behind(file):
    volume = load_volume(file)
    os.utime(file, ns=(1, 1))
    block_ranges(volume, 4, (0, 0, 0))
    assert not cache_path(file).exists()


def test_what_is_broken_is_not_copied_to_the_file_that_is_written_next(file, passes):
    np.save(
        file, np.random.default_rng(0).integers(0, 9, (99, 98, 97))
    )  # its headers are read without its ends
    ranges_of(file)
    content = cache_path(file).read_bytes()
    place = content.index(ranges_of(file)[1].astype(np.int64).tobytes())
    cache_path(file).write_bytes(content[:place] + b"broken" + content[place + 6 :])
    for _ in range(2):
        ranges_of(file, (2, 2, 2))
    assert len(passes) == 2
    ranges_of(file)
    assert len(passes) == 3


def test_what_is_compressed_is_not_copied_since_it_may_be_of_any_length(file):
    ranges_of(file)
    compressed(cache_path(file))
    ranges_of(file, (2, 2, 2))
    with np.load(cache_path(file)) as archive:
        assert sorted(archive) == ["greatest 4 2 2 2", "key", "least 4 2 2 2", "value_bounds"]


def test_voxels_in_another_order_have_other_ranges(tmp_path):
    values = voxels()[:30, :30, :30].copy()
    file = tmp_path / "cube.npy"
    np.save(file, values)
    state = file.stat()
    ranges_of(file)
    np.save(file, values.T)  # the same bytes: what the header calls x is z
    os.utime(file, ns=(state.st_atime_ns, state.st_mtime_ns))
    assert_right(file, values.T)


class Interrupted(BaseException):
    """Stands for Ctrl-C."""


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), Interrupted()])
def test_a_write_that_is_cut_short_leaves_no_half_file(file, error, monkeypatch):
    def broken(*_, **__):
        raise error

    monkeypatch.setattr(np.lib.format, "write_array", broken)
    if isinstance(error, Interrupted):
        with pytest.raises(Interrupted):
            ranges_of(file)
    else:
        assert ranges_of(file)[0].shape == (8, 8, 8)
    assert [path.name for path in file.parent.iterdir()] == ["scan.npy"]


def test_where_nothing_can_be_written_nothing_is_said(file, monkeypatch):
    def refused(*_, **__):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("pathlib.Path.open", refused)
    volume = load_volume_mapped(file)
    assert block_ranges(volume, 4, (0, 0, 0))[0].shape == (8, 8, 8)
    monkeypatch.undo()
    assert [path.name for path in file.parent.iterdir()] == ["scan.npy"]


def load_volume_mapped(file):
    """A volume of a file in a folder that nothing can be opened in any more."""
    volume = blocks.Volume(np.load(file, mmap_mode="r"))
    block_cache.keep_beside(volume, file)
    return volume


@pytest.mark.parametrize("word", ["0", "off", "OFF", " no ", "false"])
def test_a_word_in_the_environment_switches_it_off(file, word, monkeypatch):
    monkeypatch.setenv(block_cache.SWITCH, word)
    ranges_of(file)
    assert not cache_path(file).exists()


def test_small_volumes_and_those_in_memory_get_no_neighbour(file, monkeypatch):
    load = load_volume(file)
    assert load.values.nbytes == 30 * 31 * 32 * 2
    monkeypatch.setattr(block_cache, "MOST_WITHOUT", load.values.nbytes)
    ranges_of(file)
    monkeypatch.setattr(block_cache, "MOST_WITHOUT", 0)
    np.savez(file.with_name("scan.npz"), volume=voxels())
    ranges_of(file.with_name("scan.npz"))
    np.save(file.with_name("big.npy"), voxels().astype(">i2"))  # turned around in memory
    ranges_of(file.with_name("big.npy"))
    assert not [path for path in file.parent.iterdir() if path.name.endswith(".volref-blocks")]


def test_info_tells_of_it(file):
    assert "block_ranges" not in describe_file(file)
    ranges_of(file)
    assert describe_file(file)["block_ranges"] == "scan.npy.volref-blocks"


def test_a_render_in_another_process_uses_it(tmp_path):
    values = np.zeros((450, 400, 400), np.uint8)
    values[200:210] = 9
    np.save(tmp_path / "large.npy", values)
    code = "import sys, volref as vr; from volref.scene import blocks; v = vr.load_volume(sys.argv[1]);"
    code += "blocks.block_ranges(v, 4, (2, 2, 2)); print('value_bounds' in vars(v))"
    environment = {name: word for name, word in os.environ.items() if name != block_cache.SWITCH}
    said = [
        subprocess.run(
            [sys.executable, "-c", code, tmp_path / "large.npy"],
            capture_output=True,
            text=True,
            check=True,
            env=environment,
        ).stdout.strip()
        for _ in range(2)
    ]
    assert said == ["False", "True"]
