import math
from bisect import bisect_right
from itertools import pairwise

import numpy as np
import pytest
from mpmath import mp, mpf

from tests.oracles.ray_integral import ray_integral
from volref.errors import SceneError
from volref.phantoms import closed, fields, scenes, transfer
from volref.phantoms.separable import pixel_ray, ray_box, separable_image
from volref.phantoms.views import view_around
from volref.scene import Camera, Scene, TransferFunction, Volume
from volref.stages.rays import pixel_rays

EPS = np.finfo(np.float64).eps


def trilinear(volume, point):
    """The interpolated value at an index point, in exact arithmetic on the samples (mpf)."""
    cells, fractions = [], []
    for p, n in zip(point, volume.size, strict=True):
        at = min(max(p, mpf(0)), mpf(n - 1))
        cell = min(int(mp.floor(at)), n - 2)
        cells.append(cell)
        fractions.append(at - cell)
    total = mpf(0)
    for corner in np.ndindex(2, 2, 2):
        share = mpf(1)
        for bit, f in zip(corner, fractions, strict=True):
            share *= f if bit else 1 - f
        i, j, k = (cell + bit for cell, bit in zip(cells, corner, strict=True))
        total += share * mpf(float(volume.values[k, j, i]))
    return total


def look_up(table, column, value):
    """One column of the table at a value, the second entry of a jump from the jump on."""
    values = table.values.tolist()
    i = bisect_right(values, value)
    if i in (0, len(values)):
        return mpf(float(column[0 if i == 0 else -1]))
    share = (value - values[i - 1]) / (mpf(values[i]) - mpf(values[i - 1]))
    return (1 - share) * mpf(float(column[i - 1])) + share * mpf(float(column[i]))


def quadrature(scene, column, row):
    """RGBA of a pixel over nothing, at 30 digits, from the samples and the table alone."""
    volume, table = scene.volume, scene.transfer
    origin, direction = pixel_ray(scene.camera, scene.width, scene.height, column, row)
    near, far = (mpf(t) for t in ray_box(origin, direction, volume))
    spacing, first = volume.spacing, volume.origin

    def index(t):
        return [
            (mpf(o) + t * mpf(d) - mpf(c)) / mpf(s)
            for o, d, c, s in zip(origin, direction, first, spacing, strict=True)
        ]

    planes = {near, far}
    for axis in range(3):
        start, step = index(mpf(0))[axis], mpf(direction[axis]) / mpf(spacing[axis])
        if step != 0:
            planes |= {t for k in range(volume.size[axis]) if near < (t := (k - start) / step) < far}
    bends = sorted(planes)
    breaks = list(bends)
    for a, b in pairwise(bends):
        va, vb = trilinear(volume, index(a)), trilinear(volume, index(b))
        breaks += [
            a + (b - a) * (k - va) / (vb - va) for k in table.values.tolist() if (k - va) * (k - vb) < 0
        ]
    colors = [
        lambda t, c=c: look_up(table, table.colors[:, c], trilinear(volume, index(near + t)))
        for c in range(3)
    ]

    def extinction(t):
        return look_up(table, table.extinction, trilinear(volume, index(near + t)))

    return ray_integral(colors, extinction, far - near, [t - near for t in breaks])


SHELLS = transfer.steps([1.5, 3.5], [(1, 0.2, 0), (0, 0.5, 1)], [2.0, 0.4])
CASES = {
    "box": lambda **k: scenes.homogeneous_scene(3, 3, **k),
    "ramp": lambda **k: scenes.ramp_scene(3, 3, size=(3, 3, 4), **k),
    "ramp with knots": lambda **k: scenes.ramp_scene(
        3, 3, size=3, transfer=transfer.few_knots(extinction=2), **k
    ),
    "exponential": lambda **k: scenes.exponential_scene(3, 3, size=4, **k),
    "ball": lambda **k: scenes.ball_scene(3, 3, size=4, radius=1.7, **k),
    "shells": lambda **k: scenes.ball_scene(3, 3, size=4, transfer=SHELLS, **k),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("parallel", [False, True])
def test_the_image_of_a_scene_agrees_with_quadrature_of_the_trilinear_field(name, parallel):
    scene, image = CASES[name](parallel=parallel, centering="node" if parallel else "cell")
    with mp.workdps(30):
        for column, row in ((1, 1), (2, 0) if parallel else (0, 2)):
            want = quadrature(scene, column, row)
            error = max(abs(mpf(h) - w) for h, w in zip(image[row, column].tolist(), want, strict=True))
            # Crossings t lie near 20, rounded to 2 ulp = 32 eps.  A bend that is off changes nothing to
            # first order; a jump (at most 4, and the two ends) shifts the depth by sigma <= 2 times it.
            assert error <= 6 * 2 * 32 * EPS


@pytest.mark.parametrize("parallel", [False, True])
def test_the_rays_of_the_closed_form_are_those_of_the_renderer(parallel):
    scene, _ = scenes.homogeneous_scene(5, 4, parallel=parallel)
    rays = pixel_rays(scene.camera, 5, 4, np.arange(20))
    for pixel in range(20):
        origin, direction = pixel_ray(scene.camera, 5, 4, pixel % 5, pixel // 5)
        # Two ways to the same numbers, a few operations each on sizes of 1 and of 16.
        assert np.abs(rays.directions[pixel] - direction).max() <= 4 * EPS
        assert np.abs(rays.origins[pixel] - origin).max() <= 16 * 4 * EPS


def test_a_homogeneous_box_is_a_slab_of_its_chord():
    camera = Camera.look_at((0, 0, 5), (0, 0, 0), (0, 1, 0), 20.0, 0.1, 10.0)
    _, image = scenes.homogeneous_scene(1, 1, camera=camera, extinction=0.3, size=4, centering="cell")
    assert image[0, 0, 3] == pytest.approx(-math.expm1(-0.3 * 4), rel=4 * EPS)


def test_every_scene_shows_its_body_and_its_background():
    for make in (
        scenes.homogeneous_scene,
        scenes.ramp_scene,
        scenes.exponential_scene,
        scenes.ball_scene,
    ):
        scene, image = make(background=(0.1, 0.2, 0.3, 1.0))
        assert image.shape == (scene.height, scene.width, 4)
        assert image[0, 0].tolist() == [0.1, 0.2, 0.3, 1.0]
        assert image[..., 3] == pytest.approx(1.0, rel=2 * EPS)  # 1 - T and T, each rounded
        assert np.abs(image[6, 8] - image[0, 0]).max() > 0.1


def test_the_exponential_scene_tends_to_the_exponential_with_the_square_of_the_spacing():
    camera = Camera.look_at((0, 0, 9), (0, 0, 0), (0, 1, 0), 20.0, 0.1, 20.0)
    errors = []
    for n in (9, 17, 33):
        scene, image = scenes.exponential_scene(
            1, 1, size=(2, 2, n), spacing=(1.0, 1.0, 4 / (n - 1)), camera=camera
        )
        colors = scene.transfer.colors[::-1]
        want = closed.exponential_extinction(*colors, 2.0, 0.02, 4.0)
        errors.append(np.abs(image[0, 0] - want).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(2.0, abs=0.1)


def test_the_ball_scene_tends_to_the_ball_with_the_square_of_the_spacing_from_inside():
    camera = Camera.look_at((0, 0, 9), (0, 0, 0), (0, 1, 0), 2.0, 0.1, 20.0)
    errors = []
    for n in (8, 16, 32, 64):
        scene, image = scenes.ball_scene(2, 2, size=n, spacing=4 / n, radius=1.3, camera=camera)
        ray = pixel_ray(scene.camera, 2, 2, 0, 0)
        errors.append(closed.homogeneous_ball((1, 1, 1), 0.3, *ray, radius=1.3)[3] - image[0, 0, 3])
        # Interpolation error of x^2 is at most h^2 / 4 per axis, so the surface moves by 3 h^2 / (8 R).
        assert (
            0 <= errors[-1] <= 0.3 * 2 * 3 * (4 / n) ** 2 / (8 * 1.3) * 1.1
        )  # 1.1: the first order is not all
    assert errors[-1] < errors[0] / 16


def test_the_image_follows_a_volume_that_is_turned_with_its_camera():
    _, image = scenes.ramp_scene(5, 4)
    turn = np.array([(0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)])
    plain = fields.linear_ramp(6)
    turned = Volume(plain.values, plain.spacing, turn @ plain.origin, turn, "node")
    camera = view_around(plain)
    view = camera.view_from_world.copy()
    view[:3, :3] = view[:3, :3] @ turn.T
    camera = Camera(view, "perspective", fov_y=camera.fov_y, near=camera.near, far=camera.far)
    moved = separable_image(Scene(turned, transfer.two_colors(), camera, 5, 4))
    # Turning by 90 degrees permutes the sums: coordinates near 30 off by a few ulp.
    assert np.abs(moved - image).max() <= 32 * 8 * EPS


def test_a_camera_in_the_volume_sees_what_lies_ahead():
    camera = Camera.look_at((0, 0, 0), (0, 0, -1), (0, 1, 0), 40.0, 0.1, 10.0)
    _, image = scenes.homogeneous_scene(1, 1, camera=camera, size=4, extinction=0.5, centering="node")
    assert image[0, 0, 3] == pytest.approx(-math.expm1(-0.5 * 1.5), rel=4 * EPS)


def test_a_ray_along_a_face_is_inside_and_one_beside_it_is_not():
    box = Volume(np.zeros((2, 2, 2)), centering="node")
    assert ray_box((1.0, 0.5, 3.0), (0.0, 0.0, -1.0), box) == (2.0, 3.0)
    assert ray_box((np.nextafter(1.0, 2), 0.5, 3.0), (0.0, 0.0, -1.0), box) == (0.0, 0.0)
    assert ray_box((0.5, 0.5, -3.0), (0.0, 0.0, -1.0), box) == (0.0, 0.0)


def test_what_has_no_closed_form_is_refused():
    camera = Camera.look_at((0, 0, 9), (0, 0, 0), (0, 1, 0), 20.0, 0.1, 20.0)
    table = transfer.grey_ramp()
    with pytest.raises(SceneError, match=r"volume\.values must be X\[i\]"):
        separable_image(Scene(fields.sphere(4), table, camera, 1, 1))
    opacity = TransferFunction([0, 1], [(1, 1, 1)] * 2, opacity=[0, 0.5])
    with pytest.raises(SceneError, match=r"transfer\.extinction must be linear"):
        separable_image(Scene(fields.linear_ramp(4), opacity, camera, 1, 1))
    matrices = Camera.from_matrices(camera.view_from_world, camera.clip_from_view(1, 1))
    with pytest.raises(SceneError, match=r"scene\.camera must come from look_at"):
        separable_image(Scene(fields.linear_ramp(4), table, matrices, 1, 1))


def test_the_default_view_holds_the_whole_volume():
    volume = fields.homogeneous_box((4, 6, 8))
    for parallel in (False, True):
        camera = view_around(volume, parallel=parallel)
        view = volume.corners @ camera.view_from_world[:3, :3].T + camera.view_from_world[:3, 3]
        clip = np.concatenate([view, np.ones((8, 1))], axis=1) @ camera.clip_from_view(1, 1).T
        assert (np.abs(clip[:, :3] / clip[:, 3:]) <= 1).all()
