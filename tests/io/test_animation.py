"""Animated PNG held to what Pillow reads of it, and to the chunks of the APNG specification."""

import struct

import numpy as np
import pytest
from PIL import Image, ImageSequence

from volref import FormatError, SceneError, write_animation
from volref.image import encode_rgba8

FRAMES = [np.random.default_rng(i).random((5, 7, 1)) * np.ones(4) for i in range(3)]


def read_back(path):
    with Image.open(path) as image:
        return [
            (np.asarray(frame.convert("RGBA")), frame.info.get("duration"))
            for frame in ImageSequence.Iterator(image)
        ]


def chunks(path):
    data, place = path.read_bytes(), 8
    while place < len(data):
        length, kind = struct.unpack(">I4s", data[place : place + 8])
        yield kind.decode(), data[place + 8 : place + 8 + length]
        place += 12 + length


@pytest.mark.parametrize("name", ["a.png", "a.apng"])
@pytest.mark.parametrize("encoding", ["srgb", "gamma2.2", "none"])
def test_the_frames_come_back_with_their_alpha(tmp_path, name, encoding):
    write_animation(tmp_path / name, FRAMES, seconds=0.25, encoding=encoding)
    read = read_back(tmp_path / name)
    assert len(read) == 3
    for frame, (codes, duration) in zip(FRAMES, read, strict=True):
        np.testing.assert_array_equal(codes, encode_rgba8(frame, encoding))
        assert duration == 250


def test_a_frame_that_is_clear_hides_the_one_before(tmp_path):
    full, clear = np.ones((4, 4, 4)), np.zeros((4, 4, 4))
    write_animation(tmp_path / "a.png", [full, clear])
    (_, _), (codes, _) = read_back(tmp_path / "a.png")
    assert (codes == 0).all()


def test_a_background_makes_the_frames_opaque(tmp_path):
    frame = np.full((2, 3, 4), 0.5)
    write_animation(tmp_path / "a.png", [frame], background=(0.0, 0.5, 1.0))
    ((codes, _),) = read_back(tmp_path / "a.png")
    expected = encode_rgba8(np.array([0.5, 0.75, 1.0, 1.0]))
    assert (codes == expected).all()


def test_equal_frames_are_shown_for_their_time_together(tmp_path):
    write_animation(tmp_path / "a.png", [FRAMES[0], FRAMES[0], FRAMES[1]], seconds=[0.1, 0.2, 0.4])
    assert [duration for _, duration in read_back(tmp_path / "a.png")] == [300, 400]


def test_the_file_says_how_often_it_plays_and_how_long_each_frame_stands(tmp_path):
    write_animation(tmp_path / "a.png", FRAMES, seconds=[0.1, 2.0, 0.033], loops=4)
    found = list(chunks(tmp_path / "a.png"))
    (control,) = [data for kind, data in found if kind == "acTL"]
    assert struct.unpack(">II", control) == (3, 4)
    delays = [struct.unpack(">HH", data[20:24]) for kind, data in found if kind == "fcTL"]
    assert [n / d for n, d in delays] == [0.1, 2.0, 0.033]


@pytest.mark.parametrize(
    ("change", "error", "fragment"),
    [
        ({"path": "a.gif"}, FormatError, "must end in .png or .apng"),
        ({"frames": []}, FormatError, "frames must hold an image"),
        ({"frames": [FRAMES[0], FRAMES[0][:4]]}, FormatError, "got (7, 5) and then (7, 4)"),
        ({"frames": [FRAMES[0][..., :3]]}, SceneError, "frames[0] must have shape (height, width, 4)"),
        ({"seconds": [0.1, 0.2]}, SceneError, "got 2 for 3 frames"),
        ({"seconds": 0}, SceneError, "seconds must be at least 0.001"),
        ({"seconds": 100}, SceneError, "seconds must be at most 65.535"),
        ({"frames": [FRAMES[0]] * 3, "seconds": 30.0}, FormatError, "got equal ones for 90.0"),
        ({"loops": -1}, SceneError, "loops must be a whole number"),
        ({"background": (0, 0, -1)}, SceneError, "background must have colours of at least 0"),
        ({"encoding": "rec709"}, SceneError, "encoding must be 'srgb'"),
    ],
)
def test_what_is_no_animation_is_refused_and_leaves_no_file(tmp_path, change, error, fragment):
    call = {"path": "a.png", "frames": FRAMES} | change
    with pytest.raises(error) as refusal:
        write_animation(tmp_path / call.pop("path"), call.pop("frames"), **call)
    assert fragment in str(refusal.value)
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_exists_is_kept_unless_told_otherwise(tmp_path):
    write_animation(tmp_path / "a.png", FRAMES)
    before = (tmp_path / "a.png").read_bytes()
    with pytest.raises(FormatError, match="must not exist yet"):
        write_animation(tmp_path / "a.png", FRAMES[:1])
    assert (tmp_path / "a.png").read_bytes() == before
    write_animation(tmp_path / "a.png", FRAMES[:1], overwrite=True)
    assert (tmp_path / "a.png").read_bytes() != before
