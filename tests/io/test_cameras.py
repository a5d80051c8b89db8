"""Cameras from files, each held to the library or the standard that its format comes from."""

import json
import struct

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from volref import Camera, FormatError, SceneError, load_camera, save_camera
from volref.stages.rays import pixel_rays

VTK = {"position": [3, 1, 2], "focalPoint": [0, 0.5, 0], "viewUp": [0.1, 1, 0], "viewAngle": 40}
VTK |= {"parallelProjection": False, "clippingRange": [0.5, 20], "parallelScale": 2.5}

# vtkCamera of VTK 9.7.2 with the numbers of VTK above: GetCompositeProjectionTransformMatrix(1.5, -1, 1).
VTK_PERSPECTIVE = [
    [1.0262319871453798, -0.10262319871453798, -1.513692181039435, 0.05131159935726907],
    [-0.22730413475056294, 2.71707733166952, -0.3383131307915356, -1.35853866583476],
    [-0.8664281725994232, -0.1444046954332372, -0.5776187817329488, 2.873285751056379],
    [-0.8241633836921342, -0.13736056394868904, -0.5494422557947561, 3.7087352266146043],
]
VTK_PARALLEL = [
    [0.14940715870910967, -0.01494071587091097, -0.22037555909593678, 0.007470357935455496],
    [-0.03309277566993553, 0.3955741091708573, -0.04925436378781102, -0.19778705458542864],
    [-0.08452957781457786, -0.01408826296909631, -0.05635305187638524, -0.6708989511164509],
    [0.0, 0.0, 0.0, 1.0],
]

# Products of two 4x4 matrices with entries below 4: some 10 roundings of that, half an ulp each.
ROUNDING = 1e-14

TURN = Rotation.from_euler("xyz", [20, -30, 50], degrees=True)


def written(folder, name, document):
    data = document if isinstance(document, bytes) else json.dumps(document).encode()
    (folder / name).write_bytes(data)
    return folder / name


def by_columns(matrix):
    return np.asarray(matrix, float).T.ravel().tolist()


def placed(rotation=TURN, shift=(1, 2, 3), scale=1.0):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation.as_matrix() * scale, shift
    return matrix


def gltf(camera=None, nodes=None, **more):
    camera = camera or {"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1, "zfar": 50}}
    nodes = nodes or [{"camera": 0, "matrix": by_columns(placed())}]
    return {"asset": {"version": "2.0"}, "nodes": nodes, "cameras": [camera], **more}


def glb(document, *, magic=b"glTF", version=2, kind=b"JSON", length=None):
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunk = struct.pack("<I4s", len(text) if length is None else length, kind) + text
    return struct.pack("<4sII", magic, version, 12 + len(chunk)) + chunk


def three(**camera):
    node = {"type": "PerspectiveCamera", "fov": 50, "zoom": 1, "near": 0.1, "far": 100, "name": "main"}
    return {
        "metadata": {"version": 4.6, "type": "Object"},
        "object": node | {"matrix": by_columns(placed())} | camera,
    }


def clip_from_world(camera, width, height):
    return camera.clip_from_view(width, height) @ camera.view_from_world


@pytest.mark.parametrize(("parallel", "expected"), [(False, VTK_PERSPECTIVE), (True, VTK_PARALLEL)])
def test_a_vtk_js_camera_is_the_matrix_that_vtk_makes_of_it(tmp_path, parallel, expected):
    path = written(tmp_path, "a.json", VTK | {"parallelProjection": parallel})
    matrix = clip_from_world(load_camera(path), 300, 200)
    np.testing.assert_allclose(matrix, expected, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize(
    "spelling",
    [
        lambda name: name,
        lambda name: "".join("_" + c.lower() if c.isupper() else c for c in name),
        lambda name: "Camera" + name[0].upper() + name[1:],
    ],
    ids=["vtk.js", "snake", "ParaView"],
)
def test_the_three_spellings_say_the_same(tmp_path, spelling):
    path = written(tmp_path, "a.json", {spelling(name): value for name, value in VTK.items()})
    matrix = clip_from_world(load_camera(path), 300, 200)
    np.testing.assert_allclose(matrix, VTK_PERSPECTIVE, rtol=0, atol=ROUNDING)


def test_a_paraview_camera_has_no_clipping_range_until_it_is_given(tmp_path):
    path = written(tmp_path, "a.json", {k: v for k, v in VTK.items() if k != "clippingRange"})
    with pytest.raises(FormatError, match=r"pass near= and far="):
        load_camera(path)
    camera = load_camera(path, near=0.25, far=30)
    assert (camera.near, camera.far) == (0.25, 30.0)


def test_a_key_names_the_camera_of_a_larger_document(tmp_path):
    path = written(tmp_path, "a.json", {"views": 2, "left": VTK, "right": VTK | {"viewAngle": 20}})
    assert load_camera(path, "right").fov_y == 20
    with pytest.raises(FormatError, match="use one of left, right"):
        load_camera(path, "middle")


def test_a_gltf_camera_has_the_rays_that_trimesh_gives_it(tmp_path):
    """trimesh writes the aspect as a ratio of angles and reads it so: it is asked after reading."""
    scene = trimesh.Scene([trimesh.creation.box()])
    scene.camera = trimesh.scene.Camera(resolution=(6, 4), fov=(60, 40), z_near=0.25)
    scene.camera_transform = placed()
    (tmp_path / "a.glb").write_bytes(scene.export(file_type="glb"))
    (tmp_path / "b.gltf").write_bytes(scene.export(file_type="gltf")["model.gltf"])
    read = trimesh.load_scene(tmp_path / "a.glb")
    half = np.tan(np.radians(40) / 2)
    read.camera.resolution = (6, 4)
    read.camera.fov = 2 * np.degrees(np.arctan(half * 6 / 4)), read.camera.fov[1]
    origins, directions, pixels = read.camera_rays()
    for name in ("a.glb", "b.gltf"):
        camera = load_camera(tmp_path / name)
        # trimesh counts rows upwards from the bottom.
        rays = pixel_rays(camera, 6, 4, (3 - pixels[:, 1]) * 6 + pixels[:, 0])
        np.testing.assert_allclose(rays.directions, directions, rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(rays.origins, origins, rtol=0, atol=ROUNDING)
        assert camera.near == 0.25


def test_a_gltf_camera_without_zfar_clips_nothing_in_the_distance(tmp_path):
    camera = {"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}
    endless = load_camera(written(tmp_path, "a.gltf", gltf(camera)))
    # The limit of the standard's matrix for an infinite projection (section 3.10.3.2).
    assert np.array_equal(endless.clip_from_view(2, 1)[2:], [[0, 0, -1, -0.2], [0, 0, -1, 0]])
    assert load_camera(tmp_path / "a.gltf", far=7.0).far == 7.0


def test_a_parallel_gltf_camera_is_the_matrix_of_the_standard(tmp_path):
    words = {"xmag": 3, "ymag": 2, "znear": 0.5, "zfar": 20}
    camera = {"type": "orthographic", "orthographic": words}
    matrix = load_camera(written(tmp_path, "a.gltf", gltf(camera))).clip_from_view(300, 200)
    expected = np.diag([1 / 3, 1 / 2, 2 / (0.5 - 20), 1])
    expected[2, 3] = (20 + 0.5) / (0.5 - 20)
    np.testing.assert_allclose(matrix, expected, rtol=0, atol=ROUNDING)


def test_gltf_nodes_carry_their_cameras_and_scales_are_ignored(tmp_path):
    nodes = [
        {"children": [1], "translation": [1, 2, 3], "scale": [2, 2, 2]},
        {"children": [2], "rotation": TURN.as_quat().tolist(), "translation": [0.5, 0, 0]},
        {"camera": 0, "name": "eye", "scale": [3, 3, 3]},
    ]
    camera = load_camera(written(tmp_path, "a.gltf", gltf(nodes=nodes)))
    np.testing.assert_allclose(camera.world_from_view, placed(shift=(2, 2, 3)), rtol=0, atol=ROUNDING)


def test_of_several_cameras_one_is_named_or_numbered(tmp_path):
    shifts = [(0, 0, i) for i in range(3)]
    nodes = [{"camera": 0, "name": f"view {i}", "translation": shifts[i]} for i in range(3)]
    path = written(tmp_path, "a.gltf", gltf(nodes=nodes))
    for key in (2, "view 2"):
        assert load_camera(path, key).world_from_view[:3, 3].tolist() == [0, 0, 2]
    with pytest.raises(
        FormatError, match=r"must hold one camera, got 3; pass key=, .* view 0, view 1, view 2"
    ):
        load_camera(path)
    with pytest.raises(FormatError, match=r"got key='view3'; use 'view 2'|use 'view \d'"):
        load_camera(path, "view3")


def test_a_three_js_camera_projects_as_its_own_formula(tmp_path):
    """PerspectiveCamera.updateProjectionMatrix: top = near tan(fov / 2) / zoom, and a frustum of that."""
    camera = load_camera(written(tmp_path, "a.json", three(zoom=1.25)))
    near, far, aspect = 0.1, 100, 1.5
    top = near * np.tan(np.radians(50) / 2) / 1.25
    right = aspect * top
    frustum = [
        [near / right, 0, 0, 0],
        [0, near / top, 0, 0],
        [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)],
        [0, 0, -1, 0],
    ]
    expected = frustum @ np.linalg.inv(placed())
    np.testing.assert_allclose(clip_from_world(camera, 300, 200), expected, rtol=0, atol=2 * ROUNDING)


def test_a_parallel_three_js_camera_may_be_off_centre(tmp_path):
    """OrthographicCamera.updateProjectionMatrix: the middle stays, half the size is divided by zoom."""
    sides = {"left": -1, "right": 5, "top": 3, "bottom": -1, "zoom": 2}
    camera = load_camera(written(tmp_path, "a.json", three(type="OrthographicCamera", **sides)))
    right, left, top, bottom, near, far = 2 + 1.5, 2 - 1.5, 1 + 1, 1 - 1, 0.1, 100
    box = [
        [2 / (right - left), 0, 0, -(right + left) / (right - left)],
        [0, 2 / (top - bottom), 0, -(top + bottom) / (top - bottom)],
        [0, 0, -2 / (far - near), -(far + near) / (far - near)],
        [0, 0, 0, 1],
    ]
    expected = box @ np.linalg.inv(placed())
    np.testing.assert_allclose(clip_from_world(camera, 300, 200), expected, rtol=0, atol=ROUNDING)


def test_a_three_js_camera_hangs_below_other_objects(tmp_path):
    document = three()
    group = {"type": "Group", "matrix": by_columns(placed(shift=(0, 0, 7))), "children": [document["object"]]}
    camera = load_camera(written(tmp_path, "a.json", {"object": group}), "main")
    np.testing.assert_allclose(
        camera.world_from_view, placed(shift=(0, 0, 7)) @ placed(), rtol=0, atol=ROUNDING
    )


@pytest.mark.parametrize("order", ["column-major", "row-major"])
@pytest.mark.parametrize("nested", [False, True])
def test_two_matrices_are_taken_in_the_order_they_state(tmp_path, order, nested):
    camera = Camera.look_at((3, 1, 2), (0, 0.5, 0), (0.1, 1, 0), 40.0, 0.5, 20.0)
    matrices = camera.view_from_world, camera.clip_from_view(3, 2)
    if order == "column-major":
        matrices = [matrix.T for matrix in matrices]
    view, projection = (matrix.tolist() if nested else matrix.ravel().tolist() for matrix in matrices)
    path = written(tmp_path, "a.json", {"view": view, "projection": projection, "order": order})
    assert np.array_equal(clip_from_world(load_camera(path), 3, 2), clip_from_world(camera, 3, 2))


def test_a_view_that_a_library_inverted_in_float32_is_affine_again(tmp_path):
    camera = Camera.look_at((3, 1, 2), (0, 0.5, 0), (0.1, 1, 0), 40.0, 0.5, 20.0)
    view = np.linalg.inv(np.linalg.inv(camera.view_from_world).astype(np.float32)).astype(float)
    view[3] = 1e-8, 0, -1e-8, 1 + 1e-7
    document = {"view": view.ravel().tolist(), "projection": camera.clip_from_view(3, 2).tolist()}
    read = load_camera(written(tmp_path, "a.json", document | {"order": "row-major"}))
    # float32 keeps 24 bits of numbers up to 4, three times.
    np.testing.assert_allclose(read.view_from_world, camera.view_from_world, rtol=0, atol=4e-6)


@pytest.mark.parametrize("clip_z", ["-1..1", "0..1"])
@pytest.mark.parametrize("kind", ["perspective", "orthographic", "matrix"])
def test_a_saved_camera_comes_back(tmp_path, kind, clip_z):
    build = Camera.orthographic if kind == "orthographic" else Camera.look_at
    camera = build((3, 1, 2), (0, 0.5, 0), (0.1, 1, 0), 40.0, 0.5, 20.0, clip_z=clip_z)
    if kind == "matrix":
        camera = Camera.from_matrices(camera.view_from_world, camera.clip_from_view(3, 2), clip_z=clip_z)
    save_camera(camera, tmp_path / "a.json", focal_distance=4.0)
    read = load_camera(tmp_path / "a.json")
    assert (read.kind, read.clip_z) == (kind, clip_z)
    np.testing.assert_allclose(
        clip_from_world(read, 3, 2), clip_from_world(camera, 3, 2), rtol=0, atol=ROUNDING
    )
    with pytest.raises(FormatError, match="must not exist yet"):
        save_camera(camera, tmp_path / "a.json")
    with pytest.raises(FormatError, match=r"must end in \.json"):
        save_camera(camera, tmp_path / "a.xml")


MATRICES = {
    "view": np.eye(4).tolist(),
    "projection": by_columns(
        Camera.look_at((0, 0, 5), (0, 0, 0), (0, 1, 0), 40.0, 0.5, 20.0).clip_from_view(1, 1)
    ),
    "order": "column-major",
}
ODD_NODE = placed(scale=np.array([1.0, 1.0, -1.0]))
SHEARED = np.array([[1, 0.5, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])

BAD = {
    "an unknown suffix": ("a.xml", b"<camera/>", "must end in .json, .gltf, .glb"),
    "no JSON": ("a.json", b"{", "must be a readable JSON document"),
    "a list": ("a.json", [1], "got no JSON object"),
    "other keys": ("a.json", {"eye": [0, 0, 1]}, "got the keys eye"),
    "a scene": ("a.json", {"format": "volref-scene"}, "use load_scene(path).camera"),
    "a horizontal angle": (
        "a.json",
        VTK | {"useHorizontalViewAngle": True},
        "use_horizontal_view_angle must",
    ),
    "a shifted window": ("a.json", VTK | {"windowCenter": [0.5, 0]}, "window_center must be 0"),
    "a window of words": ("a.json", VTK | {"windowCenter": {"x": 1}}, "window_center must be 0"),
    "two spellings": ("a.json", VTK | {"view_up": [0, 1, 0]}, "must state view_up once"),
    "no focal point": ("a.json", {"position": [0, 0, 1], "clippingRange": [1, 2]}, "must state focal_point"),
    "no angle": ("a.json", {k: v for k, v in VTK.items() if k != "viewAngle"}, "must state view_angle"),
    "an angle of words": ("a.json", VTK | {"viewAngle": "wide"}, "view_angle must be a number"),
    "an eye of two": ("a.json", VTK | {"position": [0, 1]}, "camera.eye must have shape (3)"),
    "one clipping plane": ("a.json", VTK | {"clippingRange": [1]}, "clipping_range must have shape (2)"),
    "swapped planes": ("a.json", VTK | {"clippingRange": [2, 1]}, "camera.far must be beyond camera.near"),
    "no order": (
        "a.json",
        {k: v for k, v in MATRICES.items() if k != "order"},
        "order must be 'column-major'",
    ),
    "the other order": ("a.json", MATRICES | {"order": "row-major"}, "transpose a WebGL array"),
    "15 numbers": ("a.json", MATRICES | {"view": [0.0] * 15}, "view must have shape (16)"),
    "a view of zeros": ("a.json", MATRICES | {"view": [0.0] * 16}, "must have the last row (0, 0, 0, 1)"),
    "no camera in three.js": ("a.json", three(type="Mesh"), "must hold a camera, got none"),
    "a part of an image": ("a.json", three(view={"enabled": True}), "camera.view must be off"),
    "a shifted film": ("a.json", three(filmOffset=5), "camera.filmOffset must be 0"),
    "no matrix": ("a.json", three(matrix=None), "matrix must have shape (16)"),
    "a scaled object": ("a.json", three(matrix=by_columns(placed(scale=2.0))), "must turn and move it only"),
    "a matrix by rows": ("a.json", three(matrix=placed().ravel().tolist()), "write it by columns"),
    "children that are none": ("a.json", three(children=[3]), "children must be objects"),
    "no gltf camera": ("a.gltf", {"asset": {}}, "must hold a camera, got none"),
    "a camera that is not there": (
        "a.gltf",
        gltf(nodes=[{"camera": 1}]),
        "must refer to one of its 1 entries",
    ),
    "a camera by name": ("a.gltf", gltf(nodes=[{"camera": "0"}]), "must refer to one of its 1 entries"),
    "nodes that are none": ("a.gltf", gltf() | {"nodes": {}}, "nodes must be a list"),
    "a circle of nodes": (
        "a.gltf",
        gltf(nodes=[{"camera": 0, "children": [0]}]),
        "must hold nodes in a tree",
    ),
    "a mirrored node": (
        "a.gltf",
        gltf(nodes=[{"camera": 0, "matrix": by_columns(ODD_NODE)}]),
        "shear or mirror",
    ),
    "a sheared node": (
        "a.gltf",
        gltf(nodes=[{"camera": 0, "matrix": by_columns(SHEARED)}]),
        "shear or mirror",
    ),
    "a flat node": ("a.gltf", gltf(nodes=[{"camera": 0, "scale": [1, 1, 0]}]), "must be invertible"),
    "a zero rotation": ("a.gltf", gltf(nodes=[{"camera": 0, "rotation": [0] * 4}]), "readable camera file"),
    "a panorama": (
        "a.gltf",
        gltf({"type": "panorama"}),
        "camera.type must be 'perspective' or 'orthographic'",
    ),
    "no yfov": ("a.gltf", gltf({"type": "perspective", "perspective": {"znear": 1}}), "camera.yfov must be"),
    "half a turn": ("a.gltf", gltf({"type": "perspective", "perspective": {"yfov": 3.2, "znear": 1}}), "180"),
    "other bytes": ("a.glb", b"glTF", "must be a GLB file of version 2"),
    "another magic": ("a.glb", glb(gltf(), magic=b"FTlg"), "must be a GLB file of version 2"),
    "version 1": ("a.glb", glb(gltf(), version=1), "must be a GLB file of version 2"),
    "another chunk": ("a.glb", glb(gltf(), kind=b"BIN\0"), "must be a GLB file of version 2"),
    "a short chunk": ("a.glb", glb(gltf(), length=99999), "the file is cut short"),
    "a huge chunk": ("a.glb", glb(gltf(), length=2**32 - 1), "must need at most"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_no_camera_is_refused_in_one_sentence(tmp_path, name):
    file, document, fragment = BAD[name]
    with pytest.raises((FormatError, SceneError)) as refusal:
        load_camera(written(tmp_path, file, document))
    message = str(refusal.value)
    assert fragment in message
    assert "; " in message
    assert "\n" not in message
