import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.oracles.meshes import bumpy_sphere
from tests.oracles.moller_trumbore import first_hits
from volref.scene.camera import Camera
from volref.scene.mesh import Mesh
from volref.scene.scene import Scene
from volref.scene.transfer import TransferFunction
from volref.scene.volume import Volume
from volref.stages.rays import pixel_rays
from volref.truth.meshes.surfaces import visible_surface

EPS = np.finfo(np.float64).eps
# A vertex moves by at most half a step of 2^-16 pixel in x and in y, an edge hence by less than one.
GRID = 2.0**-16

VIEW = {"eye": (2.4, 1.7, 1.6), "target": (0, 0, 0), "up": (0, 0, 1)}
INSIDE = {"eye": (0.3, 0.2, -0.1), "target": (1, 0.4, 0.2), "up": (0, 0, 1)}


def crossing_meshes():
    """Return three spheres and a large tilted plane that pass through each other."""
    plane = Mesh([(-9, -9, -0.7), (9, -9, 0.2), (9, 9, 0.8), (-9, 9, -0.1)], [(0, 1, 2), (0, 2, 3)])
    return [
        bumpy_sphere(900, colors=(1, 0, 0)),
        bumpy_sphere(700, bump=0.3, center=(0.5, 0.4, 0.2), radius=0.8, colors=(0, 1, 0)),
        plane,
        bumpy_sphere(400, center=(-0.3, 0.6, 0.1), radius=0.9, colors=(0, 0, 1)),
    ]


def off_centre(camera, width, height, *, reverse=False, clip_z="-1..1"):
    """Return the camera with its image shifted by a tenth and an eighth, as given matrices."""
    clip = camera.clip_from_view(width, height).copy()
    column = 3 if camera.is_parallel else 2
    clip[0, column] += 0.1
    clip[1, column] -= 0.125
    near, far = camera.near, camera.far
    least = -1.0 if clip_z == "-1..1" else 0.0
    at_near, at_far = (1.0, least) if reverse else (least, 1.0)
    if camera.is_parallel:
        clip[2, 2] = (at_near - at_far) / (far - near)
        clip[2, 3] = at_near + clip[2, 2] * near
    else:
        clip[2, 3] = (at_near - at_far) * near * far / (far - near)
        clip[2, 2] = clip[2, 3] / far - at_far
    return Camera.from_matrices(camera.view_from_world, clip, clip_z=clip_z)


PERSPECTIVE = Camera.look_at(**VIEW, fov_y=40.0, near=0.1, far=100.0)
PARALLEL = Camera.orthographic(**VIEW, height=2.6, near=0.5, far=20.0)
CLOSE_UP = Camera.look_at(**INSIDE, fov_y=75.0, near=0.62, far=100.0)
WIDTH, HEIGHT = 96, 80
CAMERAS = {
    "perspective": PERSPECTIVE,
    "parallel": PARALLEL,
    "camera inside, cut by near": CLOSE_UP,
    "cut by near and far": Camera.look_at(**VIEW, fov_y=40.0, near=2.7, far=3.4),
    "parallel, cut by near and far": Camera.orthographic(**VIEW, height=2.6, near=2.9, far=3.5),
    "off-centre": off_centre(PERSPECTIVE, WIDTH, HEIGHT),
    "off-centre, reversed, 0..1": off_centre(PERSPECTIVE, WIDTH, HEIGHT, reverse=True, clip_z="0..1"),
    "off-centre, parallel, 0..1": off_centre(PARALLEL, WIDTH, HEIGHT, clip_z="0..1"),
    "off-centre, inside": off_centre(CLOSE_UP, WIDTH, HEIGHT, reverse=True),
}


def compare_with_brute_force(scene, count, seed=0):
    """Assert equal triangles and distances at random pixels; return how many pixels were set apart."""
    surface = visible_surface(scene)
    rng = np.random.default_rng(seed)
    pixels = np.sort(rng.choice(scene.width * scene.height, count, replace=False))
    triangles = np.concatenate([mesh.vertices[mesh.faces] for mesh in scene.meshes])
    hits = first_hits(scene.camera, scene.width, scene.height, triangles, pixels)
    clear = hits.margin > GRID
    starts = np.cumsum([0] + [len(mesh.faces) for mesh in scene.meshes])
    mesh, face = surface.mesh.ravel()[pixels], surface.face.ravel()[pixels]
    found = np.where(mesh >= 0, starts[mesh] + face, -1)
    np.testing.assert_array_equal(found[clear], hits.triangle[clear])
    hit = clear & (found >= 0)
    difference = np.abs(surface.distance.ravel()[pixels][hit] - hits.distance[hit])
    assert (difference <= hits.rounding[hit]).all()
    assert (surface.distance.ravel()[pixels][clear & (found < 0)] == np.inf).all()
    return int((~clear).sum()), int(hit.sum())


@pytest.mark.parametrize("name", CAMERAS)
@pytest.mark.parametrize("meshes", ["sphere", "crossing"])
def test_triangles_and_distances_are_those_of_brute_force(name, meshes):
    chosen = [bumpy_sphere(1600)] if meshes == "sphere" else crossing_meshes()
    scene = Scene(None, None, CAMERAS[name], WIDTH, HEIGHT, meshes=chosen)
    apart, hit = compare_with_brute_force(scene, 1000)
    assert hit > 100
    # 1600 triangles with edges of about 4 pixels are 10^4 pixels of edges, each with a strip 2^-15 wide:
    # 0.04 of 1000 pixels of 7680 is expected, and 3 or more would be a chance of 10^-5.
    assert apart <= 2


def test_a_ray_through_the_middle_of_an_edge_is_set_apart():
    """The control of the margin: here the oracle must not claim to know."""
    camera = Camera.look_at((0, 0, 5), (0, 0, 0), (0, 1, 0), 40.0, 0.1, 10.0)
    edge = np.array([[[0.0, -1, 0], [0, 1, 0], [1, 0, 0]]])
    assert first_hits(camera, 5, 5, edge, np.array([12])).margin[0] < GRID
    assert first_hits(camera, 5, 5, edge - [0.01, 0, 0], np.array([12])).margin[0] > 1e-3


def test_embree_sees_the_same_triangles():
    """Embree computes in float32: it may differ where a ray passes within 0.01 pixel of an edge.

    A pixel is 0.03 world units here and a triangle some 2 pixels; float32 places a point 4 units away to
    2.4e-7 and a volume of three edges of 4, 4 and 0.06 to some eps of 1, which is 1e-3 of a triangle's own.
    """
    from trimesh import Trimesh
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    scene = Scene(None, None, PERSPECTIVE, WIDTH, HEIGHT, meshes=[bumpy_sphere(1600)])
    mesh = scene.meshes[0]
    pixels = np.arange(WIDTH * HEIGHT)
    rays = pixel_rays(scene.camera, WIDTH, HEIGHT, pixels)
    intersector = RayMeshIntersector(Trimesh(mesh.vertices, mesh.faces, process=False))
    seen = intersector.intersects_first(np.array(rays.origins), np.array(rays.directions))
    differ = np.flatnonzero(seen != visible_surface(scene).face.ravel())
    margin = first_hits(scene.camera, WIDTH, HEIGHT, mesh.vertices[mesh.faces], differ).margin
    assert (margin < 0.01).all()
    # The strips of 0.01 pixel hold one pixel in 40 at most.
    assert len(differ) < WIDTH * HEIGHT / 40


@pytest.mark.parametrize("meshes", ["sphere", "crossing"])
def test_the_clip_range_and_reversed_depth_change_nothing(meshes):
    chosen = [bumpy_sphere(1600)] if meshes == "sphere" else crossing_meshes()
    images = []
    for reverse in (False, True):
        for clip_z in ("-1..1", "0..1"):
            camera = off_centre(PERSPECTIVE, 64, 48, reverse=reverse, clip_z=clip_z)
            images.append(visible_surface(Scene(None, None, camera, 64, 48, meshes=chosen)))
    for image in images[1:]:
        np.testing.assert_array_equal(image.distance, images[0].distance)
        np.testing.assert_array_equal(image.face, images[0].face)


def test_a_far_plane_at_infinity_hides_nothing():
    clip = PERSPECTIVE.clip_from_view(64, 48).copy()
    clip[2] = 0, 0, -1, -0.2
    endless = Camera.from_matrices(PERSPECTIVE.view_from_world, clip)
    assert endless.far == np.inf
    images = [
        visible_surface(Scene(None, None, camera, 64, 48, meshes=crossing_meshes()))
        for camera in (PERSPECTIVE, endless)
    ]
    np.testing.assert_array_equal(images[0].distance, images[1].distance)


def test_a_camera_far_from_the_origin_sees_the_same():
    """World coordinates of 1e6 lose 1e-10; no pixel of this scene is that close to an edge."""
    shift = np.array([1e6, -2e6, 5e5])
    images = []
    for offset in (0 * shift, shift):
        camera = Camera.look_at(VIEW["eye"] + offset, offset, (0, 0, 1), 40.0, 0.1, 100.0)
        mesh = bumpy_sphere(1600, center=offset)
        images.append(visible_surface(Scene(None, None, camera, 64, 48, meshes=[mesh])))
    np.testing.assert_array_equal(images[0].face, images[1].face)


def random_mesh(rng, count, **options):
    return Mesh(rng.uniform(-1, 1, (3 * count, 3)), np.arange(3 * count).reshape(-1, 3), **options)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_the_order_of_triangles_changes_neither_distance_nor_colour(seed):
    rng = np.random.default_rng(seed)
    mesh = random_mesh(rng, 15, colors=rng.random((15, 3)), coloring="face")
    order = rng.permutation(15)
    shuffled = Mesh(mesh.vertices, mesh.faces[order], colors=mesh.colors[order], coloring="face")
    images = [
        visible_surface(Scene(None, None, PERSPECTIVE, 24, 20, meshes=[each])) for each in (mesh, shuffled)
    ]
    np.testing.assert_array_equal(images[0].distance, images[1].distance)
    np.testing.assert_array_equal(images[0].color, images[1].color)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_splitting_a_mesh_into_several_changes_nothing(seed):
    rng = np.random.default_rng(seed)
    mesh = random_mesh(rng, 15)
    parts = [Mesh(mesh.vertices, mesh.faces[some]) for some in (slice(0, 4), slice(4, 5), slice(5, 15))]
    whole = visible_surface(Scene(None, None, PERSPECTIVE, 24, 20, meshes=[mesh]))
    split = visible_surface(Scene(None, None, PERSPECTIVE, 24, 20, meshes=parts))
    np.testing.assert_array_equal(whole.distance, split.distance)
    hit = split.mesh >= 0
    np.testing.assert_array_equal(hit, whole.mesh == 0)
    np.testing.assert_array_equal(whole.face[hit], (np.array([0, 4, 5])[split.mesh] + split.face)[hit])


@pytest.mark.parametrize("kind", ["perspective", "parallel"])
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_moving_the_camera_and_the_mesh_together_changes_nothing(kind, seed):
    rng = np.random.default_rng(seed)
    rotation, upper = np.linalg.qr(rng.normal(size=(3, 3)))
    rotation *= np.sign(np.diag(upper))
    rotation[:, 0] *= np.linalg.det(rotation)
    shift = rng.uniform(-3, 3, 3)

    def seen(move, vertices):
        eye, target = move(np.array(VIEW["eye"])), move(np.zeros(3))
        up = move(np.array([0.0, 0, 1])) - target
        if kind == "perspective":
            camera = Camera.look_at(eye, target, up, 40.0, 0.1, 100.0)
        else:
            camera = Camera.orthographic(eye, target, up, 2.6, 0.5, 20.0)
        mesh = Mesh(move(vertices), np.arange(len(vertices)).reshape(-1, 3))
        surface = visible_surface(Scene(None, None, camera, 24, 20, meshes=[mesh]))
        return surface, first_hits(camera, 24, 20, mesh.vertices[mesh.faces], np.arange(480))

    vertices = rng.uniform(-1, 1, (30, 3))
    still, hits = seen(lambda points: points, vertices)
    moved, moved_hits = seen(lambda points: points @ rotation.T + shift, vertices)
    # A pixel nearer to an edge than the grid may go either way.
    clear = (hits.margin > GRID).reshape(20, 24)
    np.testing.assert_array_equal(still.face[clear], moved.face[clear])
    hit = clear & (still.face >= 0)
    # The move rounds each vertex and the camera, which the tilt of the surface magnifies as it does the rays.
    rounding = (hits.rounding + moved_hits.rounding).reshape(20, 24)[hit]
    assert (np.abs(still.distance[hit] - moved.distance[hit]) <= rounding).all()


def test_two_triangles_that_share_an_edge_through_the_near_plane_leave_no_crack():
    """A floor under the eye, from behind the camera to the horizon: every pixel below it is covered once."""
    camera = Camera.look_at((0, 0, 1), (0.3, 5, 0.2), (0, 0, 1), 60.0, 0.5, 1000.0)
    corners = [(-70, -50, 0), (60, -40, 0), (80, 300, 0), (-90, 310, 0)]
    images = []
    for faces in ([(0, 1, 2), (0, 2, 3)], [(0, 2, 3), (0, 1, 2)]):
        floor = Mesh(corners, faces)
        images.append(visible_surface(Scene(None, None, camera, 101, 97, meshes=[floor])))
    # The two orders differ in which triangle wins a pixel that has both: nowhere.
    hit = images[0].face >= 0
    np.testing.assert_array_equal(images[0].face[hit], 1 - images[1].face[hit])
    np.testing.assert_array_equal(hit, images[1].face >= 0)
    assert {0, 1} <= set(np.unique(images[0].face))
    # The lower half looks at the floor beyond the near plane, in a column without a gap.
    assert hit[60:].all()
    assert (np.diff(hit.astype(int), axis=0) >= 0).all()


def test_a_triangle_a_million_times_the_image_is_drawn_right():
    """Through the guard band: the wall z = 0 is seen at closed-form distances everywhere."""
    camera = Camera.look_at((0.3, 0.2, 2), (0.3, 0.2, 0), (0, 1, 0), 60.0, 0.1, 10.0)
    wall = Mesh([(-3e6, -2e6, 0), (4e6, -2.5e6, 0), (0.1, 5e6, 0)], [(0, 1, 2)])
    surface = visible_surface(Scene(None, None, camera, 40, 30, meshes=[wall]))
    x = (np.arange(40) + 0.5 - 20) * np.tan(np.radians(30)) / 15
    y = (np.arange(30) + 0.5 - 15) * np.tan(np.radians(30)) / 15
    expected = 2 * np.sqrt(1 + x[None, :] ** 2 + y[:, None] ** 2)
    # Corners of 5e6 rounded in the weights: a few eps of that, of which the wall's z = 0 keeps nothing
    # but what the direction's own rounding makes of it.
    np.testing.assert_allclose(surface.distance, expected, rtol=0, atol=8 * 5e6 * EPS)


def test_the_edge_of_a_huge_triangle_runs_where_it_should():
    """Its long edge x = y / 3 passes the image, with ends far outside the guard band."""
    camera = Camera.orthographic((0, 0, 1), (0, 0, 0), (0, 1, 0), 64.0, 0.0, 2.0)
    triangle = Mesh([(-1e6, -3e6, 0), (1e6, 3e6, 0), (9e6, -1e6, 0)], [(0, 1, 2)])
    hit = visible_surface(Scene(None, None, camera, 64, 64, meshes=[triangle])).face == 0
    x, y = np.arange(64) + 0.5 - 32, 32 - (np.arange(64) + 0.5)
    # Where 3 x = y exactly the centre is on the triangle's left edge, which counts.
    np.testing.assert_array_equal(hit, 3 * x[None, :] - y[:, None] >= 0)


def test_of_coincident_triangles_the_first_mesh_is_seen():
    triangle, first, second = [(-1, -1, 0), (1, -1, 0), (0, 1, 0)], (1, 0, 0), (0, 0, 1)
    meshes = [Mesh(triangle, [(0, 1, 2)], colors=first), Mesh(triangle, [(2, 1, 0)], colors=second)]
    for order in (meshes, meshes[::-1]):
        surface = visible_surface(Scene(None, None, PERSPECTIVE, 32, 32, meshes=order))
        assert set(np.unique(surface.mesh)) == {-1, 0}
        assert (
            surface.color[surface.mesh == 0].tolist()
            == [order[0].colors.tolist()] * (surface.mesh == 0).sum()
        )


def test_where_nothing_is_hit_all_fields_say_so():
    mesh = Mesh([(50, 50, 50), (51, 50, 50), (50, 51, 50)], [(0, 1, 2)])
    surface = visible_surface(Scene(None, None, PERSPECTIVE, 4, 3, meshes=[mesh]))
    assert (surface.distance == np.inf).all()
    assert (surface.color == 0).all()
    assert (surface.mesh == -1).all()
    assert (surface.face == -1).all()
    assert surface.color.shape == (3, 4, 3)


def oblique_floor(**options):
    """Return a square floor 4 x 4 seen at a flat angle, its camera, and (s, t) on it, 0 to 1, per pixel."""
    eye = np.array([0.0, -3.0, 1.0])
    camera = Camera.look_at(eye, (0, 0.5, 0), (0, 0, 1), 45.0, 0.1, 100.0)
    floor = Mesh([(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)], [(0, 1, 2), (0, 2, 3)], **options)
    forward = np.array([0, 3.5, -1]) / np.hypot(3.5, 1)
    right, up = np.array([1.0, 0, 0]), np.array([0, 1, 3.5]) / np.hypot(3.5, 1)
    tangent = np.tan(np.radians(22.5))
    x = (2 * (np.arange(60) + 0.5) / 60 - 1) * tangent * 60 / 40
    y = (1 - 2 * (np.arange(40) + 0.5) / 40) * tangent
    directions = forward + x[None, :, None] * right + y[:, None, None] * up
    t = np.where(directions[..., 2] < 0, -eye[2] / np.where(directions[..., 2] < 0, directions[..., 2], 1), 0)
    ground = eye + t[..., None] * directions
    return Scene(None, None, camera, 60, 40, meshes=[floor]), (ground[..., :2] + 2) / 4


def test_textures_are_perspective_correct():
    """A bilinear texture of a ramp is the ramp itself between the outer texel centres."""
    size = 64
    ramp = (np.arange(size) + 0.5) / size
    texture = np.zeros((size, size, 3))
    texture[..., 0], texture[..., 1] = ramp[None, :], ramp[::-1, None]
    scene, place = oblique_floor(uv=[(0, 0), (1, 0), (1, 1), (0, 1)], texture=texture)
    surface = visible_surface(scene)
    inner = (place > 0.5 / size).all(axis=2) & (place < 1 - 0.5 / size).all(axis=2)
    assert inner.sum() > 500
    # Weights to some 40 eps at this angle (1 in 10), an index of up to 64 texels.
    np.testing.assert_allclose(surface.color[inner][:, :2], place[inner], rtol=0, atol=400 * EPS)


def test_vertex_colours_are_perspective_correct():
    scene, place = oblique_floor(colors=[(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], coloring="vertex")
    surface = visible_surface(scene)
    inside = (place > 0.001).all(axis=2) & (place < 0.999).all(axis=2)
    assert inside.sum() > 500
    np.testing.assert_allclose(surface.color[inside][:, :2], place[inside], rtol=0, atol=400 * EPS)
    # A colour linear on the screen would be off by more than a tenth in the middle.
    rows = np.flatnonzero(inside[:, 30])
    straight = np.interp(rows, rows[[0, -1]], place[rows[[0, -1]], 30, 1])
    assert np.abs(straight - place[rows, 30, 1]).max() > 0.1


def hit_points(scene, surface):
    """Return the pixels that show a mesh, and where their rays meet it."""
    pixels = np.flatnonzero(surface.mesh.ravel() >= 0)
    rays = pixel_rays(scene.camera, scene.width, scene.height, pixels)
    return pixels, rays.origins + surface.distance.ravel()[pixels, None] * rays.directions


@pytest.mark.parametrize("name", CAMERAS)
@pytest.mark.parametrize("coloring", ["vertex", "texture"])
def test_attributes_that_are_linear_in_space_are_so_on_the_image_of_every_camera(name, coloring):
    """A colour, or a texture of a ramp, that grows along x and z: known wherever a ray ends."""
    shape = bumpy_sphere(400)
    place = (shape.vertices[:, [0, 2]] + 2) / 4
    if coloring == "vertex":
        style = {"colors": np.column_stack([place, place[:, 0]])}
    else:
        ramp = (np.arange(64) + 0.5) / 64
        texture = np.zeros((64, 64, 3))
        texture[..., 0], texture[..., 1], texture[..., 2] = ramp, ramp[::-1, None], ramp
        style = {"uv": place, "texture": texture}
    mesh = Mesh(shape.vertices, shape.faces, **style)
    scene = Scene(None, None, CAMERAS[name], 48, 40, meshes=[mesh])
    surface = visible_surface(scene)
    pixels, points = hit_points(scene, surface)
    assert len(pixels) > 50
    expected = (points[:, [0, 2, 0]] + 2) / 4
    # A point to 40 eps of 4 over a cosine of 1 : 100, 1/4 of that as a colour; at an edge, the z-buffer's
    # grid of 2^-16 pixel of 0.1 may take the point of a triangle beside the ray.
    error = np.abs(surface.color.reshape(-1, 3)[pixels] - expected).max(axis=1)
    assert np.quantile(error, 0.99) <= 4000 * EPS
    assert error.max() <= 0.1 * 2.0**-16


@pytest.mark.parametrize("name", CAMERAS)
def test_front_and_back_sides_together_are_the_whole_and_show_their_side(name):
    shape = bumpy_sphere(400)
    both, front, back = (
        visible_surface(
            Scene(None, None, CAMERAS[name], 48, 40, meshes=[Mesh(shape.vertices, shape.faces, sides=sides)])
        )
        for sides in ("both", "front", "back")
    )
    np.testing.assert_array_equal(np.minimum(front.distance, back.distance), both.distance)
    corners = shape.vertices[shape.faces]
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    rays = pixel_rays(CAMERAS[name], 48, 40, np.arange(48 * 40))
    for surface, sign in ((front, -1), (back, 1)):
        hit = surface.face.ravel() >= 0
        normals = outward[surface.face.ravel()[hit]]
        cosine = (normals * rays.directions[hit]).sum(axis=1) / np.linalg.norm(normals, axis=1)
        # A ray that the grid of 2^-16 pixel puts on a triangle's far side may see it edge-on.
        assert (sign * cosine > -1e-5).all()
        assert hit.sum() > 20 or ("inside" in name and surface is front)


def test_a_texel_seen_straight_on_fills_its_pixel_at_half_a_pixel():
    """Eight texels on eight pixels: texel centres fall on pixel centres, row 0 of the texture on top."""
    texture = np.random.default_rng(2).random((8, 8, 3))
    camera = Camera.orthographic((0, 0, 1), (0, 0, 0), (0, 1, 0), 8.0, 0.0, 2.0)
    square = Mesh(
        [(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)],
        [(0, 1, 2), (0, 2, 3)],
        uv=[(0, 0), (1, 0), (1, 1), (0, 1)],
        texture=texture,
    )
    surface = visible_surface(Scene(None, None, camera, 8, 8, meshes=[square]))
    # Weights to a few eps, times 8 texels.
    np.testing.assert_allclose(surface.color, texture, rtol=0, atol=64 * EPS)


def test_a_parallel_camera_measures_from_its_near_plane():
    camera = Camera.orthographic((0, 0, 5), (0, 0, 0), (0, 1, 0), 2.0, -1.0, 10.0)
    wall = Mesh([(-9, -9, 0), (9, -9, 0), (0, 9, 0)], [(0, 1, 2)])
    surface = visible_surface(Scene(None, None, camera, 3, 3, meshes=[wall]))
    np.testing.assert_allclose(surface.distance, 6.0, rtol=4 * EPS)


def test_a_scene_without_meshes_shows_no_surface():
    volume = Volume(np.zeros((2, 2, 2)))
    transfer = TransferFunction([0.0], [(1, 1, 1)], [0.0])
    surface = visible_surface(Scene(volume, transfer, PERSPECTIVE, 4, 3))
    assert (surface.distance == np.inf).all()
    assert (surface.mesh == -1).all()
