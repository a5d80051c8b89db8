"""A bundle is data from a stranger: damaged, foreign or lying ones are refused in one sentence."""

import json
import os
import shutil

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import volref as vr
from tests.damage import damage_path
from tests.golden.bundles import (
    HEIGHT,
    WIDTH,
    contents_of,
    copied,
    manifest_of,
    put_array,
    put_file,
    put_manifest,
)


def refusal(folder, **options):
    """The sentence of a refusal."""
    with pytest.raises(vr.FormatError) as caught:
        vr.load_bundle(folder, **options)
    sentence = str(caught.value)
    assert "\n" not in sentence
    assert "; " in sentence, "it names a cure"
    return sentence


@pytest.fixture
def victim(bundle, tmp_path):
    """A bundle to damage."""
    return copied(bundle, tmp_path / "victim")


def test_every_file_is_missed(bundle, tmp_path):
    for number, path in enumerate(contents_of(bundle)):
        folder = copied(bundle, tmp_path / str(number))
        (folder / path).unlink()
        assert path.rpartition("/")[2] in refusal(folder)


def test_every_file_that_is_cut_short_or_has_one_bit_flipped_is_refused(bundle, tmp_path):
    for path, content in contents_of(bundle).items():
        if path == "manifest.json":
            continue
        folder = copied(bundle, tmp_path / "a")
        (folder / path).write_bytes(content[:-1])
        assert f"got {len(content) - 1} bytes in place of {len(content)}" in refusal(folder)
        (folder / path).write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
        assert "got another SHA-256" in refusal(folder)
        shutil.rmtree(folder)


def test_a_truncated_manifest_is_refused(victim):
    text = (victim / "manifest.json").read_text()
    (victim / "manifest.json").write_text(text[: len(text) // 2])
    assert "JSON" in refusal(victim)


@pytest.mark.parametrize(
    ("document", "said"),
    [
        ([], "format must be 'volref-golden'"),
        ({}, "format must be 'volref-golden', got None"),
        ({"format": "volref-scene"}, "this is no golden bundle"),
        ({"format": "volref-golden", "format_version": 2}, "install a newer volref"),
        ({"format": "volref-golden", "format_version": -1}, "a version from 0 to 1"),
        ({"format": "volref-golden", "format_version": "1"}, "a version from 0 to 1"),
        ({"format": "volref-golden", "format_version": True}, "a version from 0 to 1"),
        ({"format": "volref-golden", "format_version": 1}, "volref must be given"),
    ],
)
def test_a_foreign_manifest_is_refused(victim, document, said):
    put_manifest(victim, document)
    assert said in refusal(victim)


def test_what_is_no_bundle_is_refused(tmp_path):
    assert "got nothing" in refusal(tmp_path / "nowhere")
    (tmp_path / "file").write_text("x")
    assert "got a file" in refusal(tmp_path / "file")
    assert "no such file" in refusal(tmp_path)


@pytest.mark.parametrize(
    "path",
    [
        "../secret.npy",
        "/etc/passwd",
        "expected/../../secret.npy",
        "C:\\secret.npy",
        "expected\\lo.npy",
        "expected//lo.npy",
        "./expected/lo.npy",
        "expected/.hidden",
        "a" * 201,
        "manifest.json",
        "expected/lo.npy\n",
        "~/secret.npy",
        "%2e%2e/secret.npy",
    ],
)
def test_no_path_leads_out_of_the_folder(victim, path):
    (victim.parent / "secret.npy").write_bytes((victim / "expected/lo.npy").read_bytes())
    document = manifest_of(victim)
    entry = next(entry for entry in document["files"] if entry["path"] == "expected/lo.npy")
    entry["path"] = document["expected"]["lo"] = path
    put_manifest(victim, document)
    assert "manifest.json: " in refusal(victim)


def test_a_link_that_leads_out_is_refused(victim):
    outside = victim.parent / "secret.npy"
    (victim / "expected/lo.npy").rename(outside)
    (victim / "expected/lo.npy").symlink_to(outside)
    assert "must stay inside the folder" in refusal(victim)


def test_a_file_listed_twice_is_refused_in_other_letters_too(victim):
    document = manifest_of(victim)
    again = dict(document["files"][0])
    for path in (again["path"], again["path"].upper()):
        put_manifest(victim, document | {"files": [*document["files"], again | {"path": path}]})
        assert "list each file once" in refusal(victim)


def test_a_file_that_the_manifest_names_but_does_not_list_is_refused(victim):
    document = manifest_of(victim)
    kept = [entry for entry in document["files"] if entry["path"] != "expected/hi.npy"]
    put_manifest(victim, document | {"files": kept})
    assert "got none for 'expected/hi.npy'" in refusal(victim)


def test_a_file_that_the_scene_names_but_nobody_lists_is_refused(victim):
    scene = json.loads((victim / "scene.json").read_text())
    (victim / "other.npy").write_bytes((victim / "scene.volume.npy").read_bytes())
    scene["volume"]["path"] = "other.npy"
    put_file(victim, "scene.json", json.dumps(scene).encode())
    assert "got none for 'other.npy'" in refusal(victim)


def test_a_file_beside_the_volume_that_would_move_it_is_refused_unless_listed(victim):
    (victim / "scene.volume.npy.json").write_text('{"spacing": [2, 2, 2]}')
    assert "got none for 'scene.volume.npy.json'" in refusal(victim)


def test_a_scene_may_name_no_format_that_names_other_files(victim):
    scene = json.loads((victim / "scene.json").read_text())
    (victim / "scene.volume.npy").rename(victim / "scene.obj")
    document = manifest_of(victim)
    entry = next(entry for entry in document["files"] if entry["path"] == "scene.volume.npy")
    entry["path"] = "scene.obj"
    put_manifest(victim, document)
    scene["volume"]["path"] = "scene.obj"
    put_file(victim, "scene.json", json.dumps(scene).encode())
    assert "must name .npy, .npz, .json files" in refusal(victim)


def test_files_that_nobody_lists_are_not_looked_at(victim):
    (victim / "notes.txt").write_text("mine")
    (victim / "expected/extra.npy").write_bytes(b"not an array")
    assert vr.load_bundle(victim).name == "tiny"


def test_a_pickle_is_not_opened_even_if_it_has_the_stated_digest(victim):
    class Bomb:
        def __reduce__(self):
            return os.mkdir, (str(victim / "exploded"),)

    put_array(victim, "expected/lo.npy", np.array([Bomb()], dtype=object), allow_pickle=True)
    assert "pickled" in refusal(victim)
    assert not (victim / "exploded").exists()


def lie(what):
    """Array in the place of expected/lo.npy."""
    return {
        "shape": np.zeros((HEIGHT, WIDTH + 1, 4)),
        "channels": np.zeros((HEIGHT, WIDTH, 3)),
        "type": np.zeros((HEIGHT, WIDTH, 4), np.float32),
        "endianness": np.zeros((HEIGHT, WIDTH, 4), ">f8"),
        "nan": np.full((HEIGHT, WIDTH, 4), np.nan),
        "order": np.full((HEIGHT, WIDTH, 4), 2.0),
        "text": np.full((HEIGHT, WIDTH, 4), "x"),
    }[what]


@pytest.mark.parametrize("what", ["shape", "channels", "type", "nan", "order", "text", "endianness"])
def test_arrays_that_are_no_intervals_of_the_image_are_refused(victim, what):
    put_array(victim, "expected/lo.npy", lie(what))
    assert "expected/lo.npy" in refusal(victim)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("pipeline", {}),
        ("device", {"format": "volref-device", "version": 1, "name": "x", "warp": 9}),
        ("image", {"width": WIDTH + 1, "height": HEIGHT, "format": "unorm8", "frames": 1}),
        ("image", {"width": WIDTH, "height": HEIGHT, "format": "unorm9", "frames": 1}),
        ("passes", [{"name": "canvas", "path": "../x"}]),
        ("files", {}),
        ("files", [{"path": "scene.json", "bytes": -1, "sha256": ""}]),
        ("files", [{"path": "scene.json", "bytes": 10**400, "sha256": ""}]),
        ("expected", {}),
        ("surprise", 1),
    ],
)
def test_a_manifest_that_does_not_go_with_itself_is_refused(victim, key, value):
    put_manifest(victim, manifest_of(victim) | {key: value})
    refusal(victim)


def test_a_bundle_larger_than_allowed_is_refused_before_it_is_read(victim):
    assert "at most 1 KiB" in refusal(victim, max_bytes=1024)
    sizes = [entry["bytes"] for entry in manifest_of(victim)["files"]]
    assert "(all files)" in refusal(victim, max_bytes=sum(sizes) - 1)
    assert vr.load_bundle(victim, max_bytes=sum(sizes)).name == "tiny"


def test_a_scene_of_another_size_than_the_image_is_refused(victim):
    scene = json.loads((victim / "scene.json").read_text())
    put_file(victim, "scene.json", json.dumps(scene | {"width": WIDTH + 1}).encode())
    assert f"image must have the size of the scene, {WIDTH + 1} x {HEIGHT}" in refusal(victim)


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 2**32))
def test_any_damage_is_refused_in_one_sentence_or_does_no_harm(bundle, tmp_path, seed):
    folder = tmp_path / "a"
    shutil.rmtree(folder, ignore_errors=True)
    copied(bundle, folder)
    damage_path(folder, np.random.default_rng(seed))
    try:
        lo, said = vr.load_bundle(folder).acceptance.lo, ""
    except vr.FormatError as error:
        lo, said = None, str(error)
    assert "\n" not in said
    assert lo is None or np.array_equal(lo, np.load(bundle / "expected/lo.npy"))
