"""Meshes from files: positions exact, colours and opacities as numbers, transforms applied."""

import dataclasses
import json

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from tests.bad_files import obj_of
from volref.errors import FormatError, SceneError
from volref.io import load_mesh, load_meshes, load_scene, save_mesh
from volref.scene import Mesh
from volref.stages.surface import surface_normals

CORNERS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], np.float64)
FACES = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])
CODES = np.array([(255, 0, 0, 255), (0, 128, 0, 255), (0, 0, 64, 255), (1, 2, 3, 255)], np.uint8)


def tetrahedron(**options):
    return trimesh.Trimesh(CORNERS, FACES, process=False, **options)


@pytest.mark.parametrize("suffix", ["ply", "glb", "off", "obj", "stl", "gltf"])
def test_positions_and_triangles_are_the_files(tmp_path, suffix):
    path = tmp_path / f"a.{suffix}"
    if suffix == "gltf":
        for name, data in trimesh.exchange.gltf.export_gltf(tetrahedron().scene()).items():
            (tmp_path / ("a.gltf" if name == "model.gltf" else name)).write_bytes(data)
    else:
        tetrahedron().export(path)
    mesh = load_mesh(path)
    assert np.array_equal(mesh.vertices[mesh.faces], CORNERS[FACES])  # exact: 0 and 1 in any format
    assert mesh.coloring == "uniform"


def test_vertex_colours_are_codes_over_255(tmp_path):
    tetrahedron(vertex_colors=CODES).export(tmp_path / "a.ply")
    mesh = load_mesh(tmp_path / "a.ply")
    assert mesh.coloring == "vertex"
    assert np.array_equal(mesh.colors, CODES[:, :3] / 255)


def test_face_colours_belong_to_faces_where_counts_agree(tmp_path):
    """A tetrahedron has 4 vertices and 4 faces, so the shape alone does not say."""
    tetrahedron(face_colors=CODES).export(tmp_path / "a.ply")
    mesh = load_mesh(tmp_path / "a.ply")
    assert mesh.coloring == "face"
    assert np.array_equal(mesh.colors, CODES[:, :3] / 255)


@pytest.mark.parametrize("suffix", ["glb", "obj"])
def test_textures_keep_row_0_at_the_top_and_v_upwards(tmp_path, suffix):
    image = np.arange(24, dtype=np.uint8).reshape(2, 4, 3) * 10
    uv = np.array([(0, 0), (1, 0), (0, 1), (0.25, 0.5)])
    material = (
        trimesh.visual.material.PBRMaterial(baseColorTexture=Image.fromarray(image))
        if suffix == "glb"
        else trimesh.visual.material.SimpleMaterial(Image.fromarray(image), diffuse=(255, 255, 255, 255))
    )
    visual = trimesh.visual.TextureVisuals(uv, material)
    tetrahedron(visual=visual).export(tmp_path / f"a.{suffix}")
    mesh = load_mesh(tmp_path / f"a.{suffix}")
    assert mesh.coloring == "texture"
    assert np.array_equal(mesh.texture, image / 255)
    # OBJ splits vertices; compare by corner.  glTF stores v downwards in float32: 1 - v is exact here.
    assert np.array_equal(mesh.uv[mesh.faces], uv[FACES])


def test_a_texture_with_a_tint_is_refused(tmp_path):
    material = trimesh.visual.material.SimpleMaterial(Image.new("RGB", (2, 2)), diffuse=(128, 255, 255, 255))
    tetrahedron(visual=trimesh.visual.TextureVisuals(CORNERS[:, :2], material)).export(tmp_path / "a.obj")
    with pytest.raises(FormatError, match="must not tint its texture, got the factor"):
        load_mesh(tmp_path / "a.obj")


def test_a_material_without_a_texture_gives_its_colour(tmp_path):
    (tmp_path / "a.mtl").write_text("newmtl red\nKd 1 0.2 0\n")
    text = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl red\nf 1/1 2/1 3/1\n"
    (tmp_path / "a.obj").write_text(text)
    mesh = load_mesh(tmp_path / "a.obj")
    assert mesh.coloring == "uniform"
    assert np.array_equal(mesh.colors, np.array([255, 51, 0]) / 255)


def test_texture_coordinates_without_a_material_give_the_plain_grey():
    mesh = load_mesh("tests/data/mesh_teapot_uv.obj")
    assert (len(mesh.vertices), len(mesh.faces) + mesh.dropped) == (3417, 6400)
    assert mesh.coloring == "uniform"
    assert mesh.colors.tolist() == [0.8, 0.8, 0.8]


def gltf_mesh(folder, image=None, factor=None, **options):
    """Return the tetrahedron as a GLB file with such a material gives it."""
    picture = None if image is None else Image.fromarray(image)
    material = trimesh.visual.material.PBRMaterial(
        baseColorTexture=picture, baseColorFactor=factor, **options
    )
    tetrahedron(visual=trimesh.visual.TextureVisuals(CORNERS[:, :2], material)).export(folder / "a.glb")
    return load_mesh(folder / "a.glb")


CLEAR_CODES = np.where(np.arange(4) == 3, [[255], [0], [64], [128]], CODES).astype(np.uint8)


@pytest.mark.parametrize("kind", ["vertex", "face"])
def test_alphas_of_vertices_and_faces_are_kept(tmp_path, kind):
    tetrahedron(**{f"{kind}_colors": CLEAR_CODES}).export(tmp_path / "a.ply")
    mesh = load_mesh(tmp_path / "a.ply")
    assert mesh.coloring == kind
    assert mesh.transparent
    assert np.array_equal(mesh.colors, CLEAR_CODES / 255)


def test_alphas_of_a_gltf_material_count_where_it_is_blended(tmp_path):
    mesh = gltf_mesh(tmp_path, factor=(255, 0, 51, 102), alphaMode="BLEND")
    assert mesh.colors.tolist() == [1, 0, 0.2, 0.4]
    image = CLEAR_CODES.reshape(2, 2, 4)
    mesh = gltf_mesh(tmp_path, image, factor=(255, 255, 255, 102), alphaMode="BLEND")
    assert np.array_equal(mesh.texture, image / 255)
    assert mesh.opacity == 0.4


@pytest.mark.parametrize("stated", [{}, {"alphaMode": "OPAQUE"}])
def test_alphas_of_a_gltf_material_mean_nothing_where_it_is_opaque(tmp_path, stated):
    mesh = gltf_mesh(tmp_path, factor=(255, 0, 51, 102), **stated)
    assert mesh.colors.tolist() == [1, 0, 0.2]
    image = CLEAR_CODES.reshape(2, 2, 4)
    mesh = gltf_mesh(tmp_path, image, **stated)
    assert np.array_equal(mesh.texture, image[..., :3] / 255)
    assert not mesh.transparent


def test_cut_outs_are_refused(tmp_path):
    assert not gltf_mesh(tmp_path, factor=(255, 0, 0, 255), alphaMode="MASK").transparent
    with pytest.raises(FormatError, match="must have no cut-outs, got a material with alphaMode MASK"):
        gltf_mesh(tmp_path, factor=(255, 0, 0, 254), alphaMode="MASK")


@pytest.mark.parametrize(("stated", "sides"), [(None, "front"), (False, "front"), (True, "both")])
def test_the_back_of_a_gltf_material_shows_if_it_is_double_sided(tmp_path, stated, sides):
    assert gltf_mesh(tmp_path, factor=(255, 0, 0, 255), doubleSided=stated).sides == sides
    tetrahedron().export(tmp_path / "a.glb")
    assert load_mesh(tmp_path / "a.glb").sides == "both"  # no material says anything


@pytest.mark.parametrize("suffix", ["ply", "glb", "obj"])
def test_normals_of_the_file_are_kept_and_none_are_made_up(tmp_path, suffix):
    tetrahedron().export(tmp_path / f"a.{suffix}")
    assert load_mesh(tmp_path / f"a.{suffix}").normals is None
    normals = np.array([(0, 0, 1), (1, 0, 0), (0, 1, 0), (0, 0.6, 0.8)])
    tetrahedron(vertex_normals=normals).export(tmp_path / f"b.{suffix}")
    mesh = load_mesh(tmp_path / f"b.{suffix}")
    # Files hold float32, or 8 decimals; OBJ splits vertices, so compare by corner.
    np.testing.assert_allclose(mesh.normals[mesh.faces], normals[FACES], rtol=0, atol=1e-7)


def test_normals_stay_across_a_surface_that_is_stretched_and_mirrored(tmp_path):
    """A mirrored body stays right side out: its flat normals agree with its vertex normals."""
    smooth = trimesh.creation.icosphere(subdivisions=2)
    smooth = trimesh.Trimesh(smooth.vertices, smooth.faces, vertex_normals=smooth.vertices, process=False)
    scene, matrix = trimesh.Scene(), np.diag([3.0, 1, -0.5, 1])
    matrix[:3, :3] = matrix[:3, :3] @ trimesh.transformations.rotation_matrix(0.7, (1, 2, 3))[:3, :3]
    scene.add_geometry(smooth, transform=matrix)
    scene.export(tmp_path / "a.glb")
    mesh = load_mesh(tmp_path / "a.glb")
    flat = surface_normals(mesh, np.arange(len(mesh.faces)), np.full((len(mesh.faces), 3), 1 / 3))
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    cosine = (flat * across).sum(axis=1) / np.linalg.norm(across, axis=1)
    assert cosine.min() > 0.95  # triangles of 1/4 radian on a sphere stretched 6 : 1


def test_the_scene_graph_places_each_copy_of_a_mesh(tmp_path):
    scene = trimesh.Scene()
    moves = [np.diag([2.0, 1, 1, 1]), trimesh.transformations.translation_matrix([5, 6, 7])]
    for i, matrix in enumerate(moves):
        scene.add_geometry(tetrahedron(), node_name=f"node{i}", geom_name="tetra", transform=matrix)
    scene.export(tmp_path / "a.glb")
    meshes = load_meshes(tmp_path / "a.glb")
    for matrix, mesh in zip(moves, meshes, strict=True):
        assert np.array_equal(
            mesh.vertices, CORNERS @ matrix[:3, :3].T + matrix[:3, 3]
        )  # small whole numbers
    with pytest.raises(FormatError, match="got 2; use load_meshes"):
        load_mesh(tmp_path / "a.glb")


def test_the_files_vertices_are_kept_unless_asked_to_merge(tmp_path):
    tetrahedron().export(tmp_path / "a.stl")
    assert len(load_mesh(tmp_path / "a.stl").vertices) == 12
    assert len(load_mesh(tmp_path / "a.stl", process=True).vertices) == 4


def test_degenerate_triangles_are_dropped_and_counted(tmp_path):
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nf 1 2 3\nf 1 2 4\n")
    mesh = load_mesh(tmp_path / "a.obj")
    assert (len(mesh.faces), mesh.dropped) == (1, 1)


@pytest.mark.parametrize("name", ["../secret.png", "none.png", "/etc/hostname"])
def test_a_texture_that_is_missing_or_outside_the_meshs_folder_is_refused(tmp_path, name):
    (tmp_path / "in").mkdir()
    Image.new("RGB", (2, 2), (9, 9, 9)).save(tmp_path / "secret.png")
    (tmp_path / "in" / "a.mtl").write_text(f"newmtl m\nKd 1 1 1\nmap_Kd {name}\n")
    text = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl m\nf 1/1 2/1 3/1\n"
    (tmp_path / "in" / "a.obj").write_text(text)
    with pytest.raises(
        FormatError, match=r"must name files that lie in its folder, got '[^']*', which cannot"
    ):
        load_mesh(tmp_path / "in" / "a.obj")


def test_a_material_file_that_is_missing_is_refused(tmp_path):
    (tmp_path / "a.obj").write_text("mtllib none.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(FormatError, match=r"got 'none\.mtl', which cannot be read"):
        load_mesh(tmp_path / "a.obj")


def test_a_point_cloud_is_no_mesh(tmp_path):
    trimesh.PointCloud(CORNERS).export(tmp_path / "a.ply")
    with pytest.raises(FormatError, match=r"must hold triangles, got PointCloud"):
        load_mesh(tmp_path / "a.ply")


def test_the_nut_and_the_white_matter_load():
    assert len(load_mesh("tests/data/mesh_nut.ply").faces) == 1046
    assert len(load_mesh("tests/data/mesh_mni_white_matter.ply").faces) == 50010


def test_a_gltf_that_asks_for_a_remote_buffer_is_refused(tmp_path):
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "http://127.0.0.1:9/a.bin", "byteLength": 12}],
        "bufferViews": [{"buffer": 0, "byteLength": 12}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 1, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
    }
    (tmp_path / "a.gltf").write_text(json.dumps(document))
    with pytest.raises(FormatError, match="must be a readable mesh file"):
        load_mesh(tmp_path / "a.gltf")


def random_mesh(seed, coloring):
    rng = np.random.default_rng(seed)
    vertices, faces = rng.normal(size=(6, 3)), rng.permutation(6).reshape(2, 3)
    channels = rng.integers(3, 5)
    style = {
        "opacity": rng.uniform(0.1, 1),
        "lit": rng.random() < 0.5,
        "sides": rng.choice(["front", "back"]),
    }
    if rng.random() < 0.5:
        style |= {"normals": rng.normal(size=(6, 3)), "back_color": rng.random(3)}
    if coloring == "texture":
        texture = rng.random((2, 3, channels))
        return Mesh(vertices, faces, uv=rng.normal(size=(6, 2)), texture=texture, wrap="clamp", **style)
    count = {"uniform": (channels,), "vertex": (6, channels), "face": (2, channels)}[coloring]
    return Mesh(vertices, faces, rng.random(count), **style)


@given(st.integers(0, 2**32), st.sampled_from(["uniform", "vertex", "face", "texture"]))
def test_npz_keeps_every_field_bit_for_bit(tmp_path_factory, seed, coloring):
    mesh = random_mesh(seed, coloring)
    path = tmp_path_factory.mktemp("mesh") / "a.npz"
    save_mesh(mesh, path)
    again = load_mesh(path)
    for field in dataclasses.fields(Mesh):
        assert np.array_equal(getattr(again, field.name), getattr(mesh, field.name)), field.name


def test_a_broken_npz_mesh_breaks_the_rules_of_mesh(tmp_path):
    np.savez(tmp_path / "a.npz", vertices=CORNERS, faces=FACES + 1)
    with pytest.raises(SceneError, match="indices that start at 1"):
        load_mesh(tmp_path / "a.npz")


def material_mesh(folder, material):
    return load_mesh(obj_of(material)(folder))


@pytest.mark.parametrize(
    ("material", "color"),
    [
        ("Kd 0.4 0.4 0.4", (0.4, 0.4, 0.4)),  # the grey that trimesh fills in where there is no Kd
        ("Kd 0.1 0.25 0.999", (0.1, 0.25, 0.999)),
        ("Ka 1 0 0", (0.8, 0.8, 0.8)),
    ],
)
def test_a_colour_in_an_mtl_file_is_taken_as_written(tmp_path, material, color):
    assert material_mesh(tmp_path, material).colors.tolist() == list(color)


def test_a_factor_of_102_in_a_glb_is_that_grey_and_not_the_default(tmp_path):
    material = trimesh.visual.material.PBRMaterial(baseColorFactor=(102, 102, 102, 255))
    tetrahedron(visual=trimesh.visual.TextureVisuals(CORNERS[:, :2], material)).export(tmp_path / "a.glb")
    assert load_mesh(tmp_path / "a.glb").colors.tolist() == [0.4, 0.4, 0.4]


@pytest.mark.parametrize(
    ("stated", "opacity"),
    [
        ("d 1", 1),
        ("d 1.0000", 1),
        ("Tr 0", 1),
        ("d -halo 1", 1),
        ("Tf 1 1 1\nNi 1.5\nillum 2", 1),
        ("d 0.25", 0.25),
        ("Tr 0.25", 0.75),
        ("d 0.333\nTr 0.6667", 0.333),
    ],
)
def test_a_material_states_its_opacity(tmp_path, stated, opacity):
    mesh = material_mesh(tmp_path, f"Kd 1 0 0\n{stated}")
    assert mesh.colors.tolist() == [1, 0, 0]
    assert mesh.opacity == opacity


def test_a_texture_with_the_default_grey_for_a_stated_tint_is_refused(tmp_path):
    Image.new("RGB", (2, 3)).save(tmp_path / "b.png")
    (tmp_path / "a.mtl").write_text("newmtl m\nmap_Kd b.png\nKd 0.4 0.4 0.4\n")
    text = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl m\nf 1/1 2/1 3/1\n"
    (tmp_path / "a.obj").write_text(text)
    with pytest.raises(FormatError, match=r"must not tint its texture, got the factor \[0\.4, 0\.4, 0\.4\]"):
        load_mesh(tmp_path / "a.obj")
    (tmp_path / "a.mtl").write_text("newmtl m\nmap_Kd b.png\n")
    assert load_mesh(tmp_path / "a.obj").coloring == "texture"


def test_a_scene_file_says_how_its_meshes_look(tmp_path):
    style = {
        "opacity": 0.5,
        "lit": True,
        "normals": [[0, 0, 1]] * 4,
        "sides": "front",
        "back_color": [0, 0, 1],
        "colors": [[1, 0, 0, 0.25]] * 4,
        "coloring": "vertex",
    }
    camera = {"kind": "perspective", "eye": [0, 0, 5], "target": [0, 0, 0], "up": [0, 1, 0]}
    document = {
        "format": "volref-scene",
        "format_version": 1,
        "width": 4,
        "height": 3,
        "camera": {**camera, "fov_y": 40.0, "near": 0.1, "far": 10.0},
        "meshes": [{"vertices": CORNERS.tolist(), "faces": FACES.tolist(), **style}],
    }
    (tmp_path / "scene.json").write_text(json.dumps(document))
    (mesh,) = load_scene(tmp_path / "scene.json").meshes
    expected = Mesh(CORNERS, FACES, **style)
    for field in dataclasses.fields(Mesh):
        assert np.array_equal(getattr(mesh, field.name), getattr(expected, field.name)), field.name
