"""Every record and every reader refuses what breaks its rules, with one sentence: name, value, rule, cure."""

import re

import numpy as np
import pytest

from tests.bad_files import BAD_FILES, CAMERA, TRIANGLE, png_bytes
from tests.bad_formats import BAD_FORMATS
from volref.errors import FormatError, SceneError
from volref.io import load_mesh, load_scene, load_volume, read_image, save_mesh, save_scene, write_png
from volref.scene import Camera, Mesh, Scene, TransferFunction, Volume

BOX = np.zeros((2, 3, 4), np.uint8)
LOOK = {key: value for key, value in CAMERA.items() if key != "kind"}
COLORS = [(0, 0, 0), (1, 1, 1)]
SQUARE = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1.1, -0.2], [0, 0, -1, 0]]


def camera(**change):
    return Camera.look_at(**(LOOK | change))


def triangle(**change):
    return Mesh(**(TRIANGLE | change))


def transfer(**change):
    return TransferFunction(**({"values": [0, 1], "colors": COLORS, "opacity": [0, 0.5]} | change))


def scene(**change):
    parts = {"volume": None, "transfer": None, "camera": camera(), "width": 8, "height": 6}
    return Scene(**(parts | {"meshes": (triangle(),)} | change))


RECORDS = [
    ("volume of two axes", lambda: Volume(BOX[0]), ("volume.values", "(3, 4)", "z first")),
    ("volume without voxels", lambda: Volume(BOX[:0]), ("volume.values", "(0, 3, 4)")),
    ("node volume one thick", lambda: Volume(BOX[:1], centering="node"), ("at least 2", "'node'")),
    ("volume of text", lambda: Volume(BOX.astype(str)), ("volume.values", "<U3", "convert")),
    ("volume of complex", lambda: Volume(BOX * 1j), ("volume.values", "complex128")),
    (
        "NaN voxel",
        lambda: Volume(np.full((1, 1, 1), np.nan)),
        ("got nan at (z, y, x) = (0, 0, 0)", "nan=VALUE"),
    ),
    ("huge integers", lambda: Volume(np.full((1, 1, 1), 2**60)), ("volume.values", "1.15292e+18", "rescale")),
    ("zero spacing", lambda: Volume(BOX, (0, 1, 1)), ("volume.spacing", "0.0", "positive")),
    ("NaN spacing", lambda: Volume(BOX, (1, np.nan, 1)), ("volume.spacing", "nan at index (1)")),
    ("two spacings", lambda: Volume(BOX, (1, 1)), ("volume.spacing", "(3)", "(2)", "give 3 numbers")),
    ("infinite origin", lambda: Volume(BOX, origin=(0, 0, np.inf)), ("volume.origin", "inf")),
    (
        "singular direction",
        lambda: Volume(BOX, direction=np.zeros((3, 3))),
        ("volume.direction", "invertible"),
    ),
    ("long direction", lambda: Volume(BOX, direction=2 * np.eye(3)), ("length 1", "2.0", "volume.spacing")),
    ("centering", lambda: Volume(BOX, centering="vertex"), ("volume.centering", "'vertex'", "choose")),
    (
        "knots out of order",
        lambda: transfer(values=[1, 0]),
        ("transfer.values", "0 after 1 at index 1", "sort"),
    ),
    (
        "one value three times",
        lambda: transfer(values=[0] * 3, colors=[(0, 0, 0)] * 3, opacity=[0] * 3),
        ("at most twice", "0 to 2", "keep"),
    ),
    ("no knots", lambda: transfer(values=[], colors=[], opacity=[]), ("transfer.values", "none")),
    ("opacity above 1", lambda: transfer(opacity=[0, 255]), ("transfer.opacity", "255", "divide")),
    ("negative colour", lambda: transfer(colors=[(0, 0, 0), (-1, 0, 0)]), ("transfer.colors", "-1", "raise")),
    ("both kinds", lambda: transfer(extinction=[0, 1]), ("one of extinction and opacity", "both")),
    ("neither kind", lambda: transfer(opacity=None), ("one of extinction and opacity", "neither")),
    ("unit distance", lambda: transfer(unit_distance=-1), ("transfer.unit_distance", "-1")),
    (
        "opacity 1 as extinction",
        lambda: TransferFunction.from_opacity([0, 1], COLORS, [0, 1], interpolation="extinction"),
        ("transfer.opacity", "below 1", "interpolation='opacity'"),
    ),
    ("up parallel to the view", lambda: camera(up=(0, 0, 3)), ("camera.up", "(0, 0, 3)", "choose another")),
    ("up zero", lambda: camera(up=(0, 0, 0)), ("camera.up", "parallel")),
    ("eye at target", lambda: camera(eye=(0, 0, 0)), ("camera.target", "camera.eye", "move")),
    ("near at far", lambda: camera(near=100), ("camera.far", "near 100 and far 100", "swap")),
    ("near behind", lambda: camera(near=-1), ("camera.near", "-1")),
    ("fov of 180", lambda: camera(fov_y=180), ("camera.fov_y", "180", "degrees")),
    ("text for a number", lambda: camera(near="x"), ("camera.near", "'x'", "number")),
    ("clip range", lambda: camera(clip_z="0-1"), ("camera.clip_z", "'0..1'", "choose")),
    (
        "transposed projection",
        lambda: Camera.from_matrices(np.eye(4), np.array(SQUARE).T),
        ("camera.clip_matrix", "transpose"),
    ),
    (
        "scaled view",
        lambda: Camera.from_matrices(np.zeros((4, 4)), SQUARE),
        ("camera.view_from_world", "last row"),
    ),
    ("empty mesh", lambda: triangle(faces=np.zeros((0, 3), int)), ("mesh.faces", "at least one row")),
    ("degenerate mesh", lambda: triangle(faces=[(0, 1, 1)]), ("mesh.faces", "area", "1 without")),
    ("faces from 1", lambda: triangle(faces=[(1, 2, 3)]), ("mesh.faces", "got 3", "start at 1")),
    ("fractional faces", lambda: triangle(faces=[(0, 1, 2.5)]), ("mesh.faces", "float64")),
    ("NaN vertex", lambda: triangle(vertices=[(0, 0, np.nan)] * 3), ("mesh.vertices", "nan")),
    ("colours of two", lambda: triangle(colors=np.ones((2, 3))), ("mesh.colors", "(2, 3)", "reshape")),
    ("texture without uv", lambda: triangle(texture=np.ones((1, 1, 3))), ("mesh.uv", "both")),
    ("zero-size scene", lambda: scene(width=0), ("scene.width", "got 0")),
    ("scene too large", lambda: scene(height=10**6), ("scene.height", "65536")),
    ("scene of nothing", lambda: scene(meshes=()), ("volume or a mesh", "neither")),
    ("volume alone", lambda: scene(volume=Volume(BOX)), ("scene.transfer", "with the other", "both")),
    ("an array for a volume", lambda: scene(volume=BOX), ("scene.volume", "ndarray", "volref.Volume")),
    ("background alpha", lambda: scene(background=(0, 0, 0, 2)), ("scene.background", "2.0", "clip")),
    ("background of light", lambda: scene(background=(1, 0, 0, 0)), ("premultiplied", "alpha 0")),
    (
        "aspect mismatch",
        lambda: scene(camera=Camera.from_matrices(np.eye(4), SQUARE)),
        ("camera.clip_matrix", "aspect", "got 1 for 8 x 6", "canvas"),
    ),
]


def assert_one_sentence(error, fragments):
    message = str(error)
    assert isinstance(error, SceneError | FormatError)
    assert "\n" not in message
    assert message.count("; ") == 1, message
    assert not message.endswith((".", "; "))
    assert re.search(r"\d{40}", message) is None  # nobody reads more digits than a float64 has
    missing = [fragment for fragment in fragments if fragment not in message]
    assert not missing, f"{missing} not in: {message}"


@pytest.mark.parametrize("case", BAD_FILES + BAD_FORMATS, ids=lambda case: f"{case.kind}: {case.name}")
def test_a_bad_file_is_refused_with_one_sentence(tmp_path, case):
    with pytest.raises((SceneError, FormatError)) as caught:
        case.load(tmp_path)
    assert_one_sentence(caught.value, case.fragments)


@pytest.mark.parametrize(
    ("action", "fragments"), [case[1:] for case in RECORDS], ids=[case[0] for case in RECORDS]
)
def test_a_bad_record_is_refused_with_one_sentence(action, fragments):
    with pytest.raises(SceneError) as caught:
        action()
    assert_one_sentence(caught.value, fragments)


def test_the_names_of_the_cases_are_different():
    names = [(case.kind, case.name) for case in BAD_FILES + BAD_FORMATS]
    assert len(set(names)) == len(names)


WRITERS = {
    "scene.json": lambda path: save_scene(scene(), path),
    "mesh.npz": lambda path: save_mesh(triangle(), path),
    "image.png": lambda path: write_png(path, np.zeros((1, 1, 4), np.uint8)),
}


@pytest.mark.parametrize("name", WRITERS)
def test_writers_refuse_a_file_that_exists_and_a_folder_that_does_not(tmp_path, name):
    (tmp_path / name).write_bytes(b"old")
    for path, fragments in (
        (tmp_path / name, (name, "must not exist yet", "--force")),
        (tmp_path / "none" / name, ("none", "choose a folder")),
    ):
        with pytest.raises(FormatError) as caught:
            WRITERS[name](path)
        assert_one_sentence(caught.value, fragments)
    assert (tmp_path / name).read_bytes() == b"old"


def test_the_neighbours_of_bad_files_are_read(tmp_path):
    """Controls: what the table refuses is refused for its fault and not for the way it is built."""
    (tmp_path / "a.png").write_bytes(png_bytes(2, 2, 8, 2))
    assert read_image(tmp_path / "a.png").shape == (2, 2, 4)
    from tests import bad_files as files

    assert load_volume(files.file_of("a.nrrd", files.nrrd_bytes(data=b"x" * 24))(tmp_path)).size == (4, 3, 2)
    assert load_volume(files.file_of("a.nii", files.nifti_bytes())(tmp_path)).size == (4, 3, 2)
    assert load_volume(files.file_of("a.npy", files.npy_bytes(BOX))(tmp_path)).size == (4, 3, 2)
    assert load_volume(files.file_of("a.raw", b"x" * 48)(tmp_path), **files.RAW).size == (4, 3, 2)
    assert load_volume(files.npz_of(volume=files.npy_bytes(BOX))(tmp_path)).size == (4, 3, 2)
    assert load_scene(files.scene_of()(tmp_path)).width == 8
    text = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    assert len(load_mesh(files.file_of("a.obj", text)(tmp_path)).faces) == 1
