"""What cannot be emulated is refused in one sentence; what can be is drawn without a warning."""

import dataclasses

import numpy as np
import pytest

from tests.emulation.scenes import HEIGHT, WIDTH, example, jitter_of, radar_example, scene_for
from volref import (
    Camera,
    Light,
    Material,
    Mesh,
    Pipeline,
    Plane,
    Scene,
    SceneError,
    TransferFunction,
    TransferFunction2D,
    Volume,
    emulate,
)
from volref.emulation.catalogue import pipelines
from volref.phantoms.meshes import sphere_mesh

BALL = sphere_mesh(2.0, (5, 5, 5), (0.8, 0.2, 0.3), subdivisions=1)


def changed(scene=None, **parts):
    return dataclasses.replace(scene or example(), **parts)


def program(**groups):
    return Pipeline("mine").with_switches(**groups)


def atlas_of_gradients():
    return program(lighting={"gradient": "sobel-bytes"}, volume={"layout": "atlas"})


def two_dimensional():
    return TransferFunction2D(np.full((4, 4, 4), 0.5), (0, 255), (0, 100))


def parallel(scene=None):
    camera = Camera.orthographic((18, 12, 15), (5, 5, 5), (0, 1, 0), 14, 1, 60)
    return changed(scene, camera=camera)


def without_far_plane():
    usual = example().camera
    project = usual.clip_from_view(WIDTH, HEIGHT)
    project[2, 2:] = -1, -2 * usual.near
    return Camera.from_matrices(usual.view_from_world, project)


def spherical(**groups):
    pipeline = pipelines()["congote2012-radar"]
    return pipeline.with_switches("mine", **groups)


def lit(light):
    return changed(scene_for("cej2020"), lights=(light,))


LAMP = Light.point((9, 9, 9), (1, 1, 1))
SPINNING = Light.point((9, 9, 9), (1, 1, 1), attenuation=(1, 0.5, 0))
JITTER = np.zeros((1, HEIGHT, WIDTH))

# What is asked for, and what its sentence must say: name, value and rule, cure.
REFUSED = [
    ("no such pipeline", lambda: emulate(example(), "texture4d"), ("pipeline", "'texture4d'", "texture3d")),
    (
        "no such device",
        lambda: emulate(example(), "texture3d", "abacus"),
        ("device", "'abacus'", "swiftshader"),
    ),
    (
        "no volume",
        lambda: emulate(Scene(None, None, example().camera, 4, 4, (BALL,)), "texture3d"),
        ("scene.volume must be a Volume", "'texture3d'", "got none", "give one"),
    ),
    (
        "a radar for a grid's program",
        lambda: emulate(radar_example(), "texture3d"),
        ("scene.volume must be a Volume", "got RadarVolume", "for radars"),
    ),
    (
        "a grid for a radar's program",
        lambda: emulate(example(), "congote2012-radar"),
        ("must be a RadarVolume", "got Volume", "for grids"),
    ),
    (
        "projection",
        lambda: emulate(changed(mode="mip"), "texture3d"),
        ("composite", "mode 'mip'", "leave it out"),
    ),
    (
        "clipping",
        lambda: emulate(changed(clip=(Plane((5, 5, 5), (0, 0, 1)),)), "texture3d"),
        ("without clipping planes", "got clipping planes", "leave it out"),
    ),
    ("no frames", lambda: emulate(example(), "vpt-eam", frames=0), ("frames", "got 0")),
    ("half a frame", lambda: emulate(example(), "vpt-eam", frames=1.5), ("frames", "1.5")),
    (
        "frames of a still",
        lambda: emulate(example(), "texture3d", frames=2),
        ("frames must be 1", "got 2", "mean_format"),
    ),
    (
        "jitter for one that has none",
        lambda: emulate(example(), "texture3d", jitter=JITTER),
        ("jitter must be None", "got numbers", "pipeline.stepping.jitter"),
    ),
    (
        "jitter of one frame",
        lambda: emulate(example(), "vpt-eam", jitter=JITTER[0]),
        ("jitter", f"({HEIGHT}, {WIDTH})"),
    ),
    (
        "jitter of another size",
        lambda: emulate(example(), "vpt-eam", jitter=JITTER[:, 1:]),
        ("jitter", f"(1, {HEIGHT - 1}, {WIDTH})"),
    ),
    (
        "jitter of too few frames",
        lambda: emulate(example(), "vpt-eam", jitter=JITTER, frames=2),
        ("jitter", f"(2, {HEIGHT}, {WIDTH})"),
    ),
    ("NaN jitter", lambda: emulate(example(), "vpt-eam", jitter=JITTER * np.nan), ("jitter", "nan")),
    (
        "meshes for one that draws none",
        lambda: emulate(changed(meshes=(BALL,)), "congote2012"),
        ("scene.meshes must be empty", "'congote2012'", "got 1", "leave them out"),
    ),
    (
        "a transparent mesh",
        lambda: emulate(changed(meshes=(BALL, dataclasses.replace(BALL, opacity=0.5))), "texture3d"),
        ("scene.meshes[1]", "opaque", "transparent", "opacity 1"),
    ),
    (
        "a lit mesh",
        lambda: emulate(changed(meshes=(dataclasses.replace(BALL, lit=True),)), "texture3d"),
        ("scene.meshes[0]", "unlit", "lit=False"),
    ),
    (
        "distances of meshes in two passes",
        lambda: emulate(changed(meshes=(BALL,)), program(rays={"kind": "coordinates"})),
        ("pipeline.meshes.kind", "'distance'", "leave the meshes out"),
    ),
    (
        "depths of meshes on a slab's rays",
        lambda: emulate(example(), program(meshes={"kind": "depth"})),
        ("pipeline.meshes.kind", "'slab'", "'coordinates'"),
    ),
    (
        "depths without a count",
        lambda: emulate(example(), program(meshes={"kind": "depth"}, rays={"kind": "coordinates"})),
        ("pipeline.meshes.kind", "'world-length'", "'count'"),
    ),
    (
        "a depth up to infinity",
        lambda: emulate(changed(camera=without_far_plane()), "arbelaz2016"),
        ("camera.far", "got inf", "behind the scene"),
    ),
    (
        "gradients in an atlas",
        lambda: emulate(example(), atlas_of_gradients()),
        ("pipeline.lighting.gradient", "'sobel-bytes'", "'3d'"),
    ),
    (
        "lights without normals",
        lambda: emulate(example(), program(lighting={"model": "lit"})),
        ("pipeline.lighting.gradient", "'none'", "'central'"),
    ),
    (
        "rows without gradients",
        lambda: emulate(example(), program(table={"rows": 4})),
        ("pipeline.table.rows", "got 0 and 4", "'sobel-bytes'"),
    ),
    (
        "weights without gradients",
        lambda: emulate(example(), program(opacity={"by_gradient": 2.0})),
        ("by_gradient", "got 2 and 1", "'sobel-bytes'"),
    ),
    (
        "a table of value and gradient",
        lambda: emulate(changed(transfer=two_dimensional()), "texture3d"),
        ("scene.transfer", "the value alone", "'texture3d'", "texture of gradients"),
    ),
    (
        "a headlight in seed 004",
        lambda: emulate(lit(Light.headlight((1, 1, 1))), "cej2020"),
        ("scene.lights", "a headlight", "point"),
    ),
    (
        "linear attenuation in seed 004",
        lambda: emulate(lit(SPINNING), "cej2020"),
        ("scene.lights", "[1.0, 0.5, 0.0]", "(c0, 0, c2)"),
    ),
    (
        "parallel rays of a focal length",
        lambda: emulate(parallel(), "burkalo2022"),
        ("camera", "'focal'", "'eye'"),
    ),
    (
        "mip levels of a slab's rays",
        lambda: emulate(example(), program(table={"filter": "linear-mipmap"})),
        ("pipeline.table.filter", "'slab'", "'linear-mipmap'"),
    ),
    (
        "a radar in a 3-D texture",
        lambda: emulate(radar_example(), spherical(volume={"layout": "3d"})),
        ("pipeline.volume.layout", "'atlas'", "'3d'"),
    ),
    ("no scene", lambda: emulate(None, "texture3d"), ("scene", "got NoneType", "build one")),
    ("a number for a pipeline", lambda: emulate(example(), 3), ("pipeline", "got int", "build one")),
    ("a number for a device", lambda: emulate(example(), "texture3d", 3), ("device", "got int", "build one")),
    (
        "jitter beyond a step",
        lambda: emulate(example(), "vpt-eam", jitter=JITTER + 1.5),
        ("jitter", "0..1", "got 1.5", "shares of a step"),
    ),
    ("jitter before a step", lambda: emulate(example(), "vpt-eam", jitter=JITTER - 1), ("jitter", "got -1")),
    (
        "another operator",
        lambda: emulate(changed(scene_for("cej2020"), lights=(LAMP,), gradient="analytic"), "cej2020"),
        ("scene.gradient", "'sobel'", "'analytic'", "pipeline.lighting.gradient"),
    ),
    (
        "a table of value and gradient in one row",
        lambda: emulate(
            changed(transfer=two_dimensional()), pipelines()["cej2020"].with_switches(table={"rows": 1})
        ),
        ("pipeline.table.rows", "got 1", "'cej2020'"),
    ),
    *(
        (
            f"{rule}, {advance}, {end}",
            lambda rule=rule, advance=advance, end=end: emulate(
                example(), program(stepping={"rule": rule, "advance": advance, "end": end})
            ),
            ("pipeline.stepping", "'"),
        )
        for rule, advance, end in [
            ("count", "add", "parameter"),
            ("count", "multiply", "outside"),
            ("count", "parameter", "outside"),
            ("world-length", "parameter", "length-before"),
            ("voxel-count", "parameter", "count"),
            ("voxel-count", "multiply", "length-left"),
            ("count", "add", "outside-above"),
        ]
    ),
    (
        "voxels of a radar",
        lambda: emulate(radar_example(), spherical(stepping={"rule": "voxel-count"})),
        ("pipeline.stepping.rule", "'voxel-count'", "choose"),
    ),
]


CARTESIAN = [name for name, pipeline in pipelines().items() if pipeline.volume.geometry == "box"]
UNLIT = [name for name, pipeline in pipelines().items() if pipeline.lighting.model == "none"]


@pytest.mark.parametrize("name", UNLIT)
def test_a_program_without_lights_refuses_a_lit_scene_and_draws_an_unlit_one(name):
    shown = scene_for(name)
    if isinstance(shown.volume, Volume):
        with pytest.raises(SceneError, match=r"scene.lights must be empty .* got 1; leave them out"):
            emulate(changed(shown, lights=(LAMP,)), name)
    unlit = changed(shown, lights=(LAMP,), material=Material("unlit"))
    np.testing.assert_array_equal(emulate(unlit, name).rgba, emulate(shown, name).rgba)


@pytest.mark.parametrize("name", CARTESIAN)
def test_a_scene_does_not_change_the_order_in_which_a_program_classifies(name):
    own = pipelines()[name].table.order
    for order in ("pre", "per-slice"):
        asked = changed(cube(), classification=order)
        if order == own:
            np.testing.assert_array_equal(drawn(asked, name).rgba, drawn(cube(), name).rgba)
            continue
        with pytest.raises(SceneError, match=f"scene.classification must be 'post' .* got '{order}'; set"):
            drawn(asked, name)


@pytest.mark.parametrize(
    ("asked", "parts"), [case[1:] for case in REFUSED], ids=[case[0] for case in REFUSED]
)
def test_what_cannot_be_drawn_is_refused_in_one_sentence_with_its_cure(asked, parts):
    with pytest.raises(SceneError) as caught:
        asked()
    sentence = str(caught.value)
    for part in parts:
        assert part in sentence
    assert " must " in sentence
    assert "got " in sentence
    assert sentence.count("; ") == 1
    # One sentence: no line, no full stop with another behind it.
    assert "\n" not in sentence
    assert ". " not in sentence.rstrip(".")


def cube(
    values=None, side=1.0, size=(3, 3), eye=(0.4, 0.6, 3.0), opacity=0.6, background=(0, 0, 0, 0), **place
):
    """A cube-shaped volume whose sides are `side` long, looked at from 3 sides away."""
    if values is None:
        values = np.random.default_rng(1).integers(0, 256, (5, 5, 5)).astype(np.uint8)
    counts = np.array(values.shape[::-1])
    spacing = side / counts
    colors = [(0.2, 0.3, 0.9), (0.9, 0.8, 0.1)]
    transfer = TransferFunction.from_opacity([0, 255], colors, [0.2, opacity], 0.5 * side)
    middle = np.full(3, side / 2)
    eye = middle + side * np.array(eye)
    camera = Camera.look_at(eye, middle, (0, 1, 0.1), 30, 0.5 * side, 9 * side)
    volume = Volume(values, spacing=spacing, origin=spacing / 2, **place)
    return Scene(volume, transfer, camera, *size, background=background)


def drawn(shown, name, **changes):
    """An emulation without lights or gradients, with a jitter where the program takes one."""
    size = (1, shown.height, shown.width)
    jitter = None if jitter_of(name) is None else np.random.default_rng(2).random(size)
    return emulate(shown, pipelines()[name].with_switches(**changes), jitter=jitter)


@pytest.mark.parametrize("name", CARTESIAN)
@pytest.mark.parametrize(
    ("what", "values", "place"),
    [
        ("floats", np.random.default_rng(3).normal(100, 90, (4, 3, 5)), {}),
        ("float32", np.random.default_rng(3).normal(100, 90, (4, 3, 5)).astype(np.float32), {}),
        ("signed", np.random.default_rng(3).integers(-128, 128, (4, 3, 5)).astype(np.int8), {}),
        (
            "between nodes",
            np.random.default_rng(3).integers(0, 256, (4, 3, 5)).astype(np.uint8),
            {"centering": "node"},
        ),
        ("one slice", np.full((1, 3, 5), 128, np.uint8), {}),
        ("one column", np.full((4, 3, 1), 128, np.uint8), {}),
        ("one voxel", np.full((1, 1, 1), 128, np.uint8), {}),
        (
            "mirrored",
            np.random.default_rng(3).integers(0, 256, (4, 3, 5)),
            {"direction": np.diag([1.0, 1.0, -1.0])},
        ),
    ],
)
def test_volumes_of_all_kinds_are_drawn(name, what, values, place):
    out = drawn(cube(values, **place), name)
    assert np.isfinite(out.rgba).all(), what
    assert out.samples[1, 1] > 0
    assert out.rgba[1, 1].any()


@pytest.mark.parametrize("name", CARTESIAN)
@pytest.mark.parametrize("size", [(1, 1), (7, 1), (1, 5)])
def test_images_of_all_shapes_are_drawn(name, size):
    out = drawn(cube(size=size), name)
    assert out.rgba.shape == (size[1], size[0], 4)
    assert out.samples.shape == out.distance.shape == (size[1], size[0])
    assert out.samples[size[1] // 2, size[0] // 2] > 0
    for target in out.passes.values():
        assert target.ndim == 4 or target.shape[:2] == (size[1], size[0])


@pytest.mark.parametrize("name", CARTESIAN)
@pytest.mark.parametrize("away", ["beside", "behind"])
def test_a_volume_that_is_not_in_view_leaves_what_the_program_leaves_of_no_ray(name, away):
    background = (0.1, 0.2, 0.3, 1.0)
    near = cube(background=background)
    eye, forward = (
        np.array((0.9, 1.1, 3.5)),
        np.array((9.0, 0, 0)) if away == "beside" else np.array((0, 0, 9.0)),
    )
    shown = changed(near, camera=Camera.look_at(eye, eye + forward, (0, 1, 0), 30, 0.5, 9))
    out = drawn(shown, name)
    assert not out.samples.any()
    assert np.isinf(out.distance).all()
    output = pipelines()[name].output
    left = {"clear": background, "black": (0, 0, 0, 1), "transparent": (0, 0, 0, 0)}[output.missed]
    if output.tone_map == "none" and output.gamma == 1.0:
        # A byte is half a step beside the background.
        assert np.abs(out.rgba - left).max() <= 0.5 / 255 + 1e-7
    assert len(np.unique(out.rgba.reshape(-1, 4), axis=0)) == 1


@pytest.mark.parametrize("name", CARTESIAN)
@pytest.mark.parametrize("side", [1e-3, 1e6])
def test_a_world_of_any_scale_is_drawn_the_same(name, side):
    # Alpha's rounding to 1, of which mpilia2018 makes the end of a ray and what lies in front, is no law.
    changes = {"output": {"format": "float"}, "stepping": {"opaque_at": None}}
    one, other = (drawn(cube(side=s, size=(5, 4)), name, **changes) for s in (1.0, side))
    apart = np.abs(one.rgba - other.rgba).max(axis=-1)
    # Positions are rounded to float32 elsewhere: a sample more or less at an exit or a silhouette, a byte of
    # a coordinate, in one pixel of twenty at most, and 2e-5 of colour in the others.
    assert np.sort(apart.reshape(-1))[-2] <= 2e-5
    assert np.abs(one.samples - other.samples).max() <= 1


def test_a_mesh_behind_everything_and_one_out_of_sight_are_drawn():
    tiny = Mesh([(0, 0, -50), (1e-9, 0, -50), (0, 1e-9, -50)], [(0, 1, 2)], (1, 0, 0))
    out = emulate(changed(cube(), meshes=(tiny,)), "texture3d")
    assert np.isinf(out.distance).all()
    np.testing.assert_array_equal(out.rgba, emulate(cube(), "texture3d").rgba)
