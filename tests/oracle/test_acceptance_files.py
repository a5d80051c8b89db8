import dataclasses
import json

import numpy as np
import pytest

import volref as vr
from tests.oracle.made_up import acceptance_of
from volref.io.npy import write_npz

FIELDS = ("lo", "hi", "nominal", "raw_lo", "raw_hi", "ambiguous", "drawn")


@pytest.fixture
def acceptance():
    random = np.random.default_rng(4)
    lo = random.random((3, 5, 4)) / 2
    coarse = acceptance_of(lo - 0.25, lo + 0.5)
    return acceptance_of(
        lo,
        lo + 0.25,
        pipeline=vr.pipelines()["congote2012"],
        device=vr.Device.named("llvmpipe"),
        ambiguous=random.random((3, 5)) < 0.5,
        causes={"8-bit weights": random.random((3, 5)), "ends of rays": np.zeros((3, 5))},
        advice="probe it",
        frames=3,
        seconds=1.5,
        low_quality=lambda: coarse,
    )


@pytest.fixture
def parts(acceptance, tmp_path):
    """Return the arrays of a file, and its document."""
    vr.save_acceptance(acceptance, tmp_path / "whole.npz")
    with np.load(tmp_path / "whole.npz") as file:
        arrays = dict(file)
    return arrays, json.loads(arrays.pop("document").tobytes())


def written(path, arrays, document):
    text = document if isinstance(document, bytes) else json.dumps(document).encode()
    write_npz(path, {"document": np.frombuffer(text, np.uint8), **arrays})
    return path


def test_what_is_saved_is_what_is_loaded(acceptance, tmp_path):
    vr.save_acceptance(acceptance, tmp_path / "a.npz")
    found = vr.load_acceptance(tmp_path / "a.npz")
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(found, name), getattr(acceptance, name))
        assert getattr(found, name).dtype == getattr(acceptance, name).dtype
    assert list(found.causes) == list(acceptance.causes)
    for name, width in acceptance.causes.items():
        np.testing.assert_array_equal(found.causes[name], width)
    for name in ("pipeline", "device", "frames", "seconds", "advice", "justified"):
        assert getattr(found, name) == getattr(acceptance, name)
    np.testing.assert_array_equal(found.low_quality().hi, acceptance.low_quality().hi)
    assert found.low_quality().low_quality is None


def test_a_file_gives_the_verdicts_of_the_intervals_it_was_written_of(acceptance, tmp_path):
    image = (acceptance.lo + 0.3).astype(np.float32)
    plain = dataclasses.replace(acceptance, low_quality=None, advice="")
    for number, one in enumerate((acceptance, plain)):
        vr.save_acceptance(one, tmp_path / f"{number}.npz")
        loaded = vr.load_acceptance(tmp_path / f"{number}.npz")
        assert vr.check(image, loaded).message == vr.check(image, one).message


def test_equal_intervals_give_equal_files_and_none_is_written_over(acceptance, tmp_path):
    for name in ("a.npz", "b.npz"):
        vr.save_acceptance(acceptance, tmp_path / name)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    with pytest.raises(vr.FormatError, match="must not exist yet"):
        vr.save_acceptance(acceptance, tmp_path / "a.npz")
    vr.save_acceptance(acceptance, tmp_path / "a.npz", overwrite=True)


@pytest.mark.parametrize(
    ("name", "change", "sentence"),
    [
        ("hi", lambda array: array[:, :-1], "hi must be float64 for an image of one size"),
        ("lo", lambda array: array.astype(np.float32), "lo must be float64 for"),
        ("drawn", lambda array: array.astype(np.uint8), "drawn must be bool for"),
        ("lo", lambda array: array * np.nan, "lo must be at most hi everywhere"),
        ("hi", lambda array: array - 1, "lo must be at most hi everywhere"),
        ("low_hi", lambda array: array - 3, "low_lo must be at most low_hi everywhere"),
        ("nominal", lambda array: array * np.inf, "nominal must be finite"),
        ("cause_1", None, "must hold the array 'cause_1', got none"),
        ("low_lo", None, "must hold the array 'low_lo', got none"),
        ("raw_lo", None, "must hold the array 'raw_lo', got none"),
    ],
)
def test_arrays_of_other_kinds_are_refused(name, change, sentence, parts, tmp_path):
    arrays, document = parts
    arrays[name] = None if change is None else change(arrays[name])
    if change is None:
        del arrays[name]
    with pytest.raises(vr.FormatError, match=sentence):
        vr.load_acceptance(written(tmp_path / "b.npz", arrays, document))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"format": "volref-pipeline"}, "acceptance.format must be 'volref-acceptance'"),
        ({"version": 2}, "acceptance.version must be 1, got 2"),
        ({"more": 1}, "acceptance must have the keys pipeline, device"),
        ({"frames": 0}, "acceptance.frames must be a whole number from 1"),
        ({"seconds": "soon"}, "acceptance.seconds must be of another kind, got 'soon'"),
        ({"causes": ["one", "one"]}, "acceptance.causes must be at most 100 names, each once, got 2"),
        ({"causes": [1, 2]}, "acceptance.causes must be at most 100 names"),
        ({"pipeline": {"name": "mine"}}, "pipeline.format must be 'volref-pipeline'"),
        ({"device": []}, "device must be an object"),
    ],
)
def test_documents_of_other_kinds_are_refused(change, sentence, parts, tmp_path):
    arrays, document = parts
    with pytest.raises(vr.FormatError, match=rf"b\.npz: {sentence}") as refused:
        vr.load_acceptance(written(tmp_path / "b.npz", arrays, document | change))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("text", [b"[]", b"{", b"\xff", b"1", b"{}"])
def test_what_is_no_document_is_refused(text, parts, tmp_path):
    with pytest.raises(vr.FormatError, match=r"b\.npz"):
        vr.load_acceptance(written(tmp_path / "b.npz", parts[0], text))


def test_other_files_are_refused_and_so_is_too_much_memory(acceptance, tmp_path):
    write_npz(tmp_path / "image.npz", {"rgba": np.zeros((2, 2, 4))})
    with pytest.raises(vr.FormatError, match=r"got a \.npz without their document"):
        vr.load_acceptance(tmp_path / "image.npz")
    vr.save_acceptance(acceptance, tmp_path / "a.npz")
    with pytest.raises(vr.FormatError, match="must need at most 1 KiB of memory"):
        vr.load_acceptance(tmp_path / "a.npz", max_bytes=1024)
    whole = (tmp_path / "a.npz").read_bytes()
    for size in (0, 10, len(whole) // 2, len(whole) - 30):
        (tmp_path / "a.npz").write_bytes(whole[:size])
        with pytest.raises(vr.FormatError, match=r"a\.npz"):
            vr.load_acceptance(tmp_path / "a.npz")
