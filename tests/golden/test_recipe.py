"""A recipe says what a bundle is made of, and its files are those it was written for."""

import json

import jsonschema
import numpy as np
import pytest

import volref as vr
from tests.golden.bundles import tiny
from volref.golden.digests import digest_of_array, digest_of_file
from volref.golden.generators import LIGHTS, MESHES, SPECIMENS, scene_of
from volref.golden.recipe import digest_of_scene, load_recipe, recipe_of, recipe_schema, subject_of

HEAD = {"format": "volref-recipe", "format_version": 1, "name": "one"}
PLAIN = HEAD | {"scene": {"specimen": "blobs"}, "pipeline": {"name": "vpt-eam"}}


def saved(folder, **changes):
    (folder / "one.json").write_text(json.dumps(PLAIN | changes))
    return load_recipe(folder / "one.json")


def test_defaults_are_an_ideal_device_one_frame_and_free_offsets(tmp_path):
    subject = subject_of(saved(tmp_path))
    assert (subject.device, subject.frames, subject.jitter) == (vr.Device(), 1, None)
    assert (subject.scene.width, subject.scene.height) == (64, 48)


def test_switches_size_device_frames_and_seeds_are_as_stated(tmp_path):
    subject = subject_of(
        saved(
            tmp_path,
            width=20,
            height=10,
            pipeline={"name": "vpt-eam", "switches": {"table": {"size": 16}}},
            device={"name": "llvmpipe"},
            frames=3,
            jitter={"seed": 4},
        )
    )
    assert (subject.scene.width, subject.scene.height, subject.frames) == (20, 10, 3)
    assert (subject.pipeline.table.size, subject.device.name) == (16, "llvmpipe")
    assert np.array_equal(subject.jitter, vr.jitter_images(20, 10, 3, 4))


def test_steady_offsets_are_one_number_a_frame(tmp_path):
    jitter = subject_of(saved(tmp_path, frames=2, jitter={"seed": 4, "steady": True})).jitter
    assert jitter.shape == (2, 48, 64)
    assert [len(np.unique(frame)) for frame in jitter] == [1, 1]


def test_scene_program_device_and_offsets_come_from_files_too(tmp_path):
    subject = tiny("vpt-eam")
    vr.save_scene(subject.scene, tmp_path / "s.json")
    (tmp_path / "p.json").write_text(subject.pipeline.to_json())
    (tmp_path / "d.json").write_text(subject.device.to_json())
    np.save(tmp_path / "j.npy", np.full((1, 8, 10), 0.25))
    sources = {
        "scene": {"path": "s.json", "sha256": digest_of_scene(tmp_path / "s.json")},
        "pipeline": {"path": "p.json", "sha256": digest_of_file(tmp_path / "p.json")},
        "device": {"path": "d.json", "sha256": digest_of_file(tmp_path / "d.json")},
        "jitter": {"path": "j.npy", "sha256": digest_of_file(tmp_path / "j.npy")},
    }
    made = subject_of(saved(tmp_path, **sources))
    assert (made.pipeline, made.device) == (subject.pipeline, subject.device)
    assert np.array_equal(made.scene.volume.values, subject.scene.volume.values)
    assert np.unique(made.jitter).tolist() == [0.25]


def test_a_scene_whose_volume_was_changed_is_refused(tmp_path):
    vr.save_scene(tiny().scene, tmp_path / "s.json")
    recipe = saved(tmp_path, scene={"path": "s.json", "sha256": digest_of_scene(tmp_path / "s.json")})
    values = np.load(tmp_path / "s.volume.npy")
    values[0, 0, 0] ^= 1
    np.save(tmp_path / "s.volume.npy", values)
    with pytest.raises(vr.FormatError, match=r"s\.json must hold what the recipe was made with"):
        subject_of(recipe)


def test_a_file_outside_the_folder_is_refused(tmp_path):
    (tmp_path / "in").mkdir()
    (tmp_path / "d.json").write_text(vr.Device().to_json())
    source = {"path": "../d.json", "sha256": digest_of_file(tmp_path / "d.json")}
    with pytest.raises(vr.FormatError, match="must stay inside"):
        subject_of(saved(tmp_path / "in", device=source))


@pytest.mark.parametrize(
    "changes",
    [
        {"format": "volref-scene"},
        {"format_version": 2},
        {"name": "../up"},
        {"name": ""},
        {"name": "one/two"},
        {"scene": {}},
        {"scene": {"specimen": "blobs", "colour": 1}},
        {"scene": {"path": "s.json"}},
        {"pipeline": "x3dom"},
        {"pipeline": {"name": "x3dom", "swatches": {}}},
        {"jitter": {"seed": 0.5}},
        {"frames": "many"},
        {"truth": True},
        {"more": 1},
    ],
)
def test_a_recipe_that_breaks_its_schema_is_refused_in_one_sentence(tmp_path, changes):
    with pytest.raises(vr.FormatError) as caught:
        recipe_of(PLAIN | changes, tmp_path / "one.json")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "changes",
    [
        {"scene": {"specimen": "blob"}},
        {"scene": {"specimen": "blobs", "mesh": "beside"}},
        {"scene": {"specimen": "blobs", "light": "moon"}},
        {"pipeline": {"name": "unreal"}},
        {"device": {"name": "voodoo"}},
        {"pipeline": {"name": "x3dom", "switches": {"table": {"sise": 2}}}},
    ],
)
def test_a_name_that_is_not_known_is_refused_in_one_sentence(tmp_path, changes):
    with pytest.raises(vr.SceneError) as caught:
        subject_of(saved(tmp_path, **changes))
    assert "\n" not in str(caught.value)


def test_the_schema_is_one(tmp_path):
    jsonschema.Draft202012Validator.check_schema(recipe_schema())
    jsonschema.Draft202012Validator(recipe_schema()).validate(dict(saved(tmp_path).document))


@pytest.mark.parametrize("name", SPECIMENS)
def test_every_specimen_is_seen_and_made_of_whole_or_half_numbers(name):
    scene = scene_of(name)
    assert (vr.render(scene, method="march").rgba[..., 3] > 0.05).mean() > 0.02
    if isinstance(scene.volume, vr.Volume):
        assert scene.volume.values.dtype.kind in "iu"
    else:
        values = np.concatenate([sweep.values.ravel() for sweep in scene.volume.sweeps])
        assert (2 * values[np.isfinite(values)] % 1 == 0).all()


@pytest.mark.parametrize("mesh", MESHES)
def test_every_mesh_is_seen(mesh):
    assert np.isfinite(vr.render(scene_of("blobs", mesh=mesh), method="march").distance).any()


@pytest.mark.parametrize("light", LIGHTS)
def test_every_light_changes_the_image(light):
    lit, plain = (vr.render(scene_of("blobs", light=name), method="march").rgba for name in (light, None))
    assert np.abs(lit - plain).max() > 0.02


def test_digests_are_of_numbers_and_not_of_how_they_are_packed(tmp_path):
    array = np.arange(6.0).reshape(2, 3)
    np.save(tmp_path / "c.npy", array)
    np.save(tmp_path / "f.npy", np.asfortranarray(array))
    np.save(tmp_path / "big.npy", array.astype(">f8"))
    assert {digest_of_file(tmp_path / name) for name in ("c.npy", "f.npy", "big.npy")} == {
        digest_of_array(array)
    }
    np.savez(tmp_path / "plain.npz", a=array)
    np.savez_compressed(tmp_path / "packed.npz", a=array)
    assert digest_of_file(tmp_path / "plain.npz") == digest_of_file(tmp_path / "packed.npz")
    (tmp_path / "a.json").write_text('{"a": 1, "b": 2}')
    (tmp_path / "b.json").write_text('{"b":2,\n"a":1}')
    assert digest_of_file(tmp_path / "a.json") == digest_of_file(tmp_path / "b.json")
    others = [array.astype(np.float32), array.T, array + 1]
    assert digest_of_array(array) not in {digest_of_array(other) for other in others}
