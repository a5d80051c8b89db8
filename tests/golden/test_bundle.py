"""What a golden bundle holds is what the program uploads, draws and may draw."""

import dataclasses
import hashlib

import jsonschema
import numpy as np
import pytest

import volref as vr
from tests.golden.bundles import HEIGHT, WIDTH, contents_of, manifest_of, tiny, written
from volref.emulation.rays.box import CORNERS, box_of
from volref.emulation.textures.uploads import uploads_of
from volref.golden import writing
from volref.golden.manifest import manifest_schema
from volref.io.documents import find_problem


def test_a_loaded_bundle_has_the_images_of_emulate_and_the_intervals_of_accept(bundle):
    loaded, subject = vr.load_bundle(bundle), tiny()
    drawn = vr.emulate(subject.scene, subject.pipeline, subject.device)
    accepted = vr.accept(subject.scene, subject.pipeline, subject.device)
    assert np.array_equal(loaded.acceptance.nominal, drawn.rgba)
    for name in ("lo", "hi", "nominal", "raw_lo", "raw_hi", "ambiguous", "drawn"):
        assert np.array_equal(getattr(loaded.acceptance, name), getattr(accepted, name)), name
    assert {name: width.tolist() for name, width in loaded.acceptance.causes.items()} == {
        name: width.tolist() for name, width in accepted.causes.items()
    }
    assert loaded.acceptance.advice == accepted.advice
    assert list(loaded.passes) == list(drawn.passes)
    assert all(np.array_equal(loaded.passes[name], target) for name, target in drawn.passes.items())


def test_a_bundle_of_a_machine_of_half_floats_is_read_back(tmp_path):
    subject = tiny("texture3d", "mediump")
    loaded = vr.load_bundle(written(tmp_path / "a", subject, derived=True))
    drawn = vr.emulate(subject.scene, subject.pipeline, subject.device).rgba
    assert drawn.dtype == np.float16
    assert np.array_equal(loaded.acceptance.nominal, drawn)


def test_scene_program_and_device_come_back(bundle):
    loaded, subject = vr.load_bundle(bundle), tiny()
    assert (loaded.name, loaded.title) == ("tiny", "A few pixels")
    assert (loaded.pipeline, loaded.device) == (subject.pipeline, subject.device)
    again = vr.emulate(loaded.scene, loaded.pipeline, loaded.device)
    assert np.array_equal(again.rgba, loaded.acceptance.nominal)


def test_every_array_is_little_endian_in_c_order_and_no_pickle(bundle):
    for path in contents_of(bundle):
        if path.endswith(".npy"):
            with (bundle / path).open("rb") as stream:
                assert np.lib.format.read_magic(stream) == (1, 0)
                _, fortran, kind = np.lib.format.read_array_header_1_0(stream)
            assert not fortran, path
            assert kind.str[0] in "<|", path


def test_a_volume_of_the_other_order_and_endianness_is_written_in_this_one(tmp_path):
    subject = tiny()
    values = np.asfortranarray(subject.scene.volume.values.astype(">i2"))
    scene = vr.Scene(vr.Volume(values), subject.scene.transfer, subject.scene.camera, WIDTH, HEIGHT)
    folder = written(tmp_path / "a", dataclasses.replace(subject, scene=scene))
    with (folder / "scene.volume.npy").open("rb") as stream:
        np.lib.format.read_magic(stream)
        _, fortran, kind = np.lib.format.read_array_header_1_0(stream)
    assert (fortran, kind.str) == (False, "<i2")
    assert np.array_equal(vr.load_bundle(folder).scene.volume.values, values)


def test_the_manifest_lists_every_file_with_its_size_and_sha256(bundle):
    listed = {entry["path"]: (entry["bytes"], entry["sha256"]) for entry in manifest_of(bundle)["files"]}
    found = {
        path: (len(held), hashlib.sha256(held).hexdigest()) for path, held in contents_of(bundle).items()
    }
    del found["manifest.json"]
    assert listed == found


def test_the_manifest_obeys_its_schema_by_a_full_implementation_too(bundle):
    document, schema = manifest_of(bundle), manifest_schema()
    jsonschema.Draft202012Validator(schema).validate(document)
    assert find_problem(document, schema, schema["$defs"], "") is None


def test_the_matrices_take_the_corners_of_the_box_to_where_the_program_has_them(bundle):
    document = manifest_of(bundle)
    corners = np.concatenate([CORNERS, np.ones((8, 1))], axis=1)
    camera = document["camera"]
    matrix = np.eye(4)
    for step in (camera["clip_from_view"], camera["view_from_world"], document["box"]["world_from_texture"]):
        matrix = matrix @ np.array(step)
    # Three products of 4 x 4 numbers of order 100, in another order than the program's: some hundred ulp.
    assert np.allclose(corners @ matrix.T, box_of(tiny().scene).clip_corners, rtol=0, atol=1e-11)


@pytest.mark.parametrize("pipeline", ["texture3d", "congote2012", "burkalo2022"])
def test_inputs_are_what_the_program_uploads(tmp_path, pipeline):
    subject = tiny(pipeline)
    folder = written(tmp_path / "a", subject)
    said, uploads = manifest_of(folder)["uploads"], uploads_of(subject.scene, subject.pipeline)
    assert np.array_equal(np.load(folder / said["volume"]), uploads.volume)
    assert np.array_equal(np.load(folder / said["table"]), uploads.table)
    assert said["volume"] == f"inputs/{'atlas' if said['layout'] == 'atlas' else 'volume'}.npy"
    assert (tuple(said["size"]), tuple(said["tiles"])) == (uploads.size, uploads.tiles)
    assert tuple(said["domain"]) == uploads.domain


def test_pictures_of_inputs_hold_the_same_bytes(tmp_path):
    from PIL import Image

    folder = written(tmp_path / "a", tiny("congote2012"))
    said = manifest_of(folder)["uploads"]
    for key in ("volume", "table"):
        codes = np.load(folder / said[key])
        with Image.open(folder / said[f"{key}_picture"]) as picture:
            assert np.array_equal(np.asarray(picture).reshape(codes.shape), codes), key


def test_the_preview_is_the_canvas_as_bytes(bundle):
    from PIL import Image

    with Image.open(bundle / "expected/preview.png") as picture:
        codes = np.asarray(picture)
    assert np.array_equal(codes / 255, np.load(bundle / "expected/nominal.npy"))


def test_start_offsets_are_none_free_or_given(tmp_path, bundle):
    assert manifest_of(bundle)["jitter"] == "none"
    free = written(tmp_path / "free", tiny("vpt-eam"))
    assert manifest_of(free)["jitter"] == "free"
    assert vr.load_bundle(free).subject.jitter is None
    offsets = vr.jitter_images(WIDTH, HEIGHT, frames=2, seed=3)
    given = written(tmp_path / "given", tiny("vpt-eam", jitter=offsets, frames=2))
    assert manifest_of(given)["jitter"] == "given"
    loaded = vr.load_bundle(given)
    assert np.array_equal(loaded.subject.jitter, offsets)
    assert (loaded.subject.frames, loaded.acceptance.frames) == (2, 2)


def test_meshes_come_as_arrays_and_as_a_model(tmp_path):
    subject = tiny("arbelaz2016", mesh="through")
    folder = written(tmp_path / "a", subject)
    (said,), mesh = manifest_of(folder)["uploads"]["meshes"], subject.scene.meshes[0]
    for name in ("vertices", "faces", "colors"):
        assert np.array_equal(np.load(folder / said[name]), getattr(mesh, name)), name
    assert said["coloring"] == "vertex"
    model = vr.load_mesh(folder / said["model"])
    assert np.array_equal(model.vertices, mesh.vertices)
    assert np.array_equal(model.faces, mesh.faces)
    distance = vr.load_bundle(folder).distance
    assert np.isfinite(distance).any()


def test_the_truth_comes_along_with_its_bound_where_it_is_asked_for(tmp_path, bundle):
    assert vr.load_bundle(bundle).truth is None
    loaded = vr.load_bundle(written(tmp_path / "a", truth=1e-3))
    out = vr.render(tiny().scene, tolerance=1e-3)
    assert np.array_equal(loaded.truth, out.rgba)
    assert np.array_equal(loaded.bound, out.bound)
    assert loaded.manifest["expected"]["bound_kind"] == "certified"


def test_a_bundle_written_twice_is_the_same_to_the_byte(tmp_path, bundle):
    again = written(tmp_path / "tiny", derived=True, title="A few pixels")
    assert contents_of(again) == contents_of(bundle)


def test_the_recipe_digest_follows_from_what_is_drawn_and_on_what_alone(tmp_path, bundle):
    def digest(name, subject):
        return manifest_of(written(tmp_path / name, subject))["recipe_sha256"]

    plain = manifest_of(bundle)["recipe_sha256"]
    assert digest("other-name", tiny()) == plain
    others = {
        digest("device", tiny(device="ideal")),
        digest("program", tiny("texture3d")),
        digest("scene", tiny(opacity=0.5)),
    }
    assert len(others | {plain}) == 4


def test_a_bundle_that_is_there_stays_unless_told_otherwise(tmp_path):
    folder = written(tmp_path / "a")
    before = contents_of(folder)
    with pytest.raises(vr.FormatError, match=r"must not exist yet.*overwrite=True \(--force\)"):
        written(folder, tiny(opacity=0.5))
    assert contents_of(folder) == before
    written(folder, tiny(opacity=0.5), overwrite=True)
    assert contents_of(folder) != before
    assert [entry.name for entry in tmp_path.iterdir()] == ["a"]


def test_a_folder_that_is_no_bundle_is_not_replaced_even_when_told(tmp_path):
    home = tmp_path / "home"
    home.mkdir()
    (home / "thesis.txt").write_text("years")
    with pytest.raises(vr.FormatError, match="other things in it"):
        written(home, overwrite=True)
    assert (home / "thesis.txt").read_text() == "years"


def test_a_program_that_cannot_draw_the_scene_leaves_nothing(tmp_path):
    with pytest.raises(vr.SceneError):
        vr.write_bundle(tmp_path / "a", tiny(light="sun").scene, "burkalo2022")
    assert list(tmp_path.iterdir()) == []


def test_an_image_is_judged_by_its_bundle(bundle):
    drawn = vr.emulate(tiny().scene, "x3dom", "swiftshader").rgba8
    assert vr.check_bundle(bundle, drawn).passed
    assert not vr.check_bundle(vr.load_bundle(bundle), drawn[::-1]).passed


def test_the_intervals_of_coarse_filters_come_along_where_there_are_such(tmp_path, monkeypatch):
    def accept(*asked):
        accepted = vr.accept(*asked)
        wide = dataclasses.replace(accepted, lo=accepted.lo - 0.1, hi=accepted.hi + 0.1)
        return dataclasses.replace(accepted, low_quality=lambda: wide)

    monkeypatch.setattr(writing, "accept", accept)
    loaded = vr.load_bundle(writing.write_subject(tmp_path / "a", tiny())).acceptance
    assert np.array_equal(loaded.low_quality().lo, loaded.lo - 0.1)
    assert np.array_equal(loaded.low_quality().hi, loaded.hi + 0.1)
