"""Where rays enter and leave the box: two passes, front faces and a slab test against an exact one."""

import math

import numpy as np
import pytest

from tests.oracles.scalar import box_span, look_at_ray
from volref import Camera, Pipeline, Scene, TransferFunction, Volume, emulate
from volref.emulation.device import Device
from volref.emulation.rays.box import box_of
from volref.emulation.rays.entering import ends_of_rays, faces
from volref.emulation.rays.paths import vector_length

IDEAL_DEVICE = Device()
WIDTH, HEIGHT = 19, 14
TRANSFER = TransferFunction.from_opacity([0, 255], [(1, 1, 1)] * 2, [0.2, 0.5])
TURN = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
UPRIGHT, MIRROR = np.eye(3), np.diag([1.0, -1.0, 1.0])
PLACES = {
    "straight": {},
    "turned": {"direction": TURN},
    "mirrored": {"direction": MIRROR},
    "turned and mirrored": {"direction": TURN @ MIRROR},
    "between nodes": {"centering": "node"},
}
MIDDLE = np.array((1.0, 2.0, 3.0))
LOOKS = {
    "oblique": ((9.0, 8.0, 12.0), (0.1, 0.3, -0.2), (0, 1, 0), 40.0),
    "along an axis": ((0.0, 0.0, 9.0), (0.0, 0.0, 0.0), (0, 1, 0), 45.0),
    "from below": ((2.0, -11.0, 1.0), (0.0, 0.2, 0.1), (0, 0, 1), 38.0),
}
IDEAL = {"slab": Pipeline("slab"), "front-face": Pipeline("front").with_switches(rays={"kind": "front-face"})}
IDEAL["coordinates"] = Pipeline("two").with_switches(rays={"kind": "coordinates"})


def placed(centering="cell", direction=UPRIGHT):
    """A volume of sides 5, 3 and 4 around the middle, however it is turned."""
    counts = np.array((5, 3, 4)) + (centering == "node")
    half = (counts - 1) / 2
    origin = MIDDLE - direction @ half
    return Volume(np.zeros(counts[::-1], np.uint8), origin=origin, direction=direction, centering=centering)


def scene(look, place=None, near=0.5, parallel=0.0, size=(WIDTH, HEIGHT)):
    eye, target, up, fov = look
    if parallel:
        camera = Camera.orthographic(MIDDLE + eye, MIDDLE + target, up, parallel, near, 90)
    else:
        camera = Camera.look_at(MIDDLE + eye, MIDDLE + target, up, fov, near, 90)
    return Scene(placed(**(place or {})), TRANSFER, camera, *size)


def ends_of(kind, shown, device=IDEAL_DEVICE, **rays):
    pipeline = IDEAL[kind].with_switches(rays=rays)
    return ends_of_rays(shown, pipeline, box_of(shown), device)


def exact_ends(shown, look, parallel=0.0):
    """Entry and exit (3,) in texture space of each pixel whose ray meets the box at t >= 0, by scalars."""
    volume, (eye, target, up, fov) = shown.volume, look
    inverse = np.linalg.inv(volume.direction)
    low, high = volume.index_bounds
    found = {}
    for y in range(shown.height):
        for x in range(shown.width):
            start, way = look_at_ray(eye, target, up, fov, shown.width, shown.height, x, y)
            if parallel:
                _, way = look_at_ray(eye, target, up, fov, 1, 1, 0, 0)
                side = np.cross(way, up) / np.linalg.norm(np.cross(way, up))
                across = ((x + 0.5) / shown.width - 0.5) * parallel * shown.width / shown.height
                upward = (0.5 - (y + 0.5) / shown.height) * parallel
                start = np.array(start) + across * side + upward * np.cross(side, way)
            begin = inverse @ (MIDDLE + np.array(start) - volume.origin)
            along = inverse @ np.array(way)
            span = box_span(begin, along, low, high)
            if span is not None:
                found[y * shown.width + x] = [(begin + t * along - low) / (high - low) for t in span]
    return found


def check_ends(ends, expected, off, edge):
    """All pixels but those that a chord shorter than `edge` meets are drawn, `off` beside the exact ends."""
    drawn = {int(pixel): k for k, pixel in enumerate(ends.pixel)}
    chords = {pixel: np.linalg.norm(b - a) for pixel, (a, b) in expected.items()}
    for pixel in drawn.keys() ^ chords.keys():
        assert chords.get(pixel, 0.0) < edge, pixel
    both = drawn.keys() & chords.keys()
    assert len(both) > 30
    for pixel in both:
        for found, exact in zip((ends.entry, ends.exit), expected[pixel], strict=True):
            np.testing.assert_allclose(found[:, drawn[pixel]], exact, rtol=0, atol=off)


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("look", LOOKS)
@pytest.mark.parametrize("kind", ["slab", "coordinates"])
def test_rays_of_a_slab_test_and_of_two_passes_are_the_exact_ones(kind, look, place):
    shown = scene(LOOKS[look], PLACES[place])
    ends, targets = ends_of(kind, shown)
    # Float32 of a texture coordinate of 0..1, computed in float64.
    check_ends(ends, exact_ends(shown, LOOKS[look]), 2**-23, 1e-6)
    assert list(targets) == (["front_coordinates", "back_coordinates"] if kind == "coordinates" else [])


@pytest.mark.parametrize("place", ["straight", "turned and mirrored", "between nodes"])
@pytest.mark.parametrize("kind", ["slab", "coordinates"])
def test_parallel_rays_are_the_exact_ones_too(kind, place):
    look = LOOKS["oblique"]
    shown = scene(look, PLACES[place], parallel=7.0)
    check_ends(ends_of(kind, shown)[0], exact_ends(shown, look, 7.0), 2**-23, 1e-6)


@pytest.mark.parametrize("parallel", [0.0, 7.0])
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("look", LOOKS)
def test_rays_of_front_faces_go_one_unit_of_texture_space_along_the_exact_ones(look, place, parallel):
    shown = scene(LOOKS[look], PLACES[place], parallel=parallel)
    ends, targets = ends_of("front-face", shown)
    assert not targets
    exact = exact_ends(shown, LOOKS[look], parallel)
    assert abs(len(exact) - len(ends.pixel)) <= 2
    # The length of a float32 vector, normalised.
    np.testing.assert_allclose(vector_length(ends.along), 1, rtol=3e-7)
    np.testing.assert_array_equal(ends.exit, ends.entry + ends.along)
    for k, pixel in enumerate(ends.pixel.tolist()):
        begin, end = exact.get(pixel, (None, None))
        if begin is None or np.linalg.norm(end - begin) < 1e-3:
            continue
        np.testing.assert_allclose(ends.entry[:, k], begin, rtol=0, atol=2**-23)
        # The eye lies up to 5 boxes away: a float32 of it is some 3e-7 off, over chords of 1e-3 and more.
        way = (end - begin) / np.linalg.norm(end - begin)
        np.testing.assert_allclose(ends.along[:, k], way, rtol=0, atol=2e-6)


@pytest.mark.parametrize("place", PLACES)
def test_targets_hold_texture_coordinates_where_faces_are_and_are_cleared_to_0(place):
    shown = scene(LOOKS["oblique"], PLACES[place])
    ends, targets = ends_of("coordinates", shown)
    for name, held in (("front_coordinates", ends.entry), ("back_coordinates", ends.exit)):
        assert targets[name].shape == (HEIGHT, WIDTH, 3)
        flat = targets[name].reshape(-1, 3)
        np.testing.assert_array_equal(flat[ends.pixel].T, held)
        assert not np.delete(flat, ends.pixel, axis=0).any()
        # On a face one coordinate is 0 or 1.
        near = np.minimum(np.abs(held), np.abs(held - 1)).min(axis=0)
        assert near.max() < 1e-6


@pytest.mark.parametrize(("kind", "digits"), [("unorm8", 255), ("half", None)])
@pytest.mark.parametrize("front", ["target", "varying"])
def test_coordinates_are_rounded_to_the_format_of_their_target(kind, digits, front):
    shown = scene(LOOKS["oblique"])
    fine, _ = ends_of("coordinates", shown)
    coarse, targets = ends_of("coordinates", shown, front=front, format=kind)

    def rounded(numbers):
        if digits:
            return np.rint(numbers * np.float32(255)) * np.float32(1 / 255)
        return numbers.astype(np.float16).astype(np.float32)

    np.testing.assert_array_equal(coarse.exit, rounded(fine.exit))
    np.testing.assert_array_equal(coarse.entry, fine.entry if front == "varying" else rounded(fine.entry))
    # The target of a program that has none is what its varying shows.
    shown_there = targets["front_coordinates"].reshape(-1, 3)[coarse.pixel].T
    np.testing.assert_array_equal(shown_there, coarse.entry)


def test_a_linear_filter_reads_a_target_where_the_box_is_large_as_a_nearest_one_does():
    shown = scene(LOOKS["oblique"])
    near, linear = (
        ends_of("coordinates", shown, front="varying", filter=word)[0] for word in ("nearest", "linear")
    )
    apart = np.abs(near.exit - linear.exit).max(axis=0)
    # At the middle of a texel it alone is read; float32 has it 1e-7 of the image beside, whose neighbour may
    # be the 0 of nothing drawn: 19 texels of that.
    assert apart.max() < 19 * 2e-7 * 3
    snapped = ends_of("coordinates", shown, Device("d", subpixel_bits=4), front="varying", filter="linear")[0]
    plain = ends_of("coordinates", shown, Device("d", subpixel_bits=4), front="varying")[0]
    # Snapped corners move the place that is read by up to 1/32 pixel.
    assert 1e-4 < np.abs(snapped.exit - plain.exit).max() <= 3 / 32


def test_an_exit_of_0_is_walked_or_left():
    # Far corner (0, 0, 0) alone: a target of bytes holds 0 within half a byte of it.
    corner, eye = MIDDLE - (2.5, 1.5, 2.0), MIDDLE + np.array((9, 8, 12))
    close = Scene(placed(), TRANSFER, Camera.look_at(eye, corner, (0, 1, 0), 0.2, 0.5, 90), 12, 12)
    walked, left = (
        ends_of("coordinates", close, format="unorm8", no_exit=word)[0] for word in ("walked", "left")
    )
    none = (walked.exit[:2] == 0).all(axis=0)
    assert 0 < none.sum() < len(none)
    np.testing.assert_array_equal(left.pixel, walked.pixel[~none])
    np.testing.assert_array_equal(left.exit, walked.exit[:, ~none])
    np.testing.assert_array_equal(left.entry, walked.entry[:, ~none])
    np.testing.assert_array_equal(left.blank, walked.pixel[none])
    assert not len(walked.blank)
    # A fragment that is left is transparent black, which replaces the background without a blend state.
    program = IDEAL["coordinates"].with_switches(
        rays={"format": "unorm8", "no_exit": "left"}, output={"blend": "none"}
    )
    background = (0.5, 0.25, 0.0, 1.0)
    out = emulate(Scene(close.volume, TRANSFER, close.camera, 12, 12, background=background), program)
    assert not out.rgba.reshape(-1, 4)[left.blank].any()


INSIDE = ((0.5, 0.3, 1.0), (-1.0, 0.0, -1.0), (0, 1, 0), 70.0)


@pytest.mark.parametrize("place", PLACES)
def test_from_inside_two_passes_draw_nothing_and_the_others_start_at_the_eye(place):
    shown = scene(INSIDE, PLACES[place], near=0.1)
    assert not len(ends_of("coordinates", shown)[0].pixel)
    counts = np.array((5, 3, 4))
    turn = PLACES[place].get("direction", UPRIGHT)
    eye = np.linalg.inv(turn) @ INSIDE[0] / counts + 0.5
    for kind in ("slab", "front-face"):
        ends, _ = ends_of(kind, shown)
        np.testing.assert_array_equal(ends.pixel, np.arange(WIDTH * HEIGHT))
        np.testing.assert_allclose(
            ends.entry, np.broadcast_to(eye[:, None], ends.entry.shape), rtol=0, atol=2**-23
        )
    expected = exact_ends(shown, INSIDE)
    slab, faced = (ends_of(kind, shown)[0] for kind in ("slab", "front-face"))
    for pixel, (begin, end) in expected.items():
        np.testing.assert_allclose(slab.exit[:, pixel], end, rtol=0, atol=2**-23)
        way = (end - begin) / np.linalg.norm(end - begin)
        np.testing.assert_allclose(faced.along[:, pixel], way, rtol=0, atol=1e-6)


def test_an_eye_on_a_face_is_not_inside():
    on_face = ((0.0, 0.0, 2.0), (0.0, 0.0, 0.0), (0, 1, 0), 60.0)
    shown = scene(on_face, near=0.1)
    assert not len(ends_of("front-face", shown)[0].pixel)
    assert len(ends_of("slab", shown)[0].pixel) == WIDTH * HEIGHT


def test_an_eye_on_the_far_face_that_looks_away_has_no_rays_of_no_length():
    # Texture space along z is exact: 0 at the face, from which all rays leave at once.
    away = ((0.0, 0.0, -2.0), (0.0, 0.0, -5.0), (0, 1, 0), 60.0)
    assert not len(ends_of("slab", scene(away, near=0.1))[0].pixel)


def test_faces_before_the_near_plane_are_clipped_with_the_rays_that_need_them():
    # The near plane cuts the box: the eye is 1 before the front face, the plane 2.5 away.
    look = ((0.3, 0.2, 3.0), (0.0, 0.0, 0.0), (0, 1, 0), 75.0)
    near, far = (scene(look, near=distance) for distance in (2.5, 0.1))
    whole = set(ends_of("slab", far)[0].pixel.tolist())
    # The slab test of the eye knows no planes.
    assert set(ends_of("slab", near)[0].pixel.tolist()) == whole
    for kind in ("coordinates", "front-face"):
        clipped = set(ends_of(kind, near)[0].pixel.tolist())
        drawn = set(ends_of(kind, far)[0].pixel.tolist())
        assert clipped < drawn
    box = box_of(near)
    seen = faces(near, box, Device(), "back")
    assert (seen.window_z >= 0).all()


def test_directions_by_the_near_plane_start_there():
    inside = scene(INSIDE, near=0.4)
    ends, _ = ends_of("slab", inside, Device.named("exact"), direction="unproject")
    shape = box_of(inside).world_from_texture
    starts = (shape[:3, :3] @ ends.entry).T + shape[:3, 3] - (MIDDLE + INSIDE[0])
    forward = np.array(INSIDE[1]) - INSIDE[0]
    forward /= math.sqrt(forward @ forward)
    np.testing.assert_allclose(starts @ forward, 0.4, rtol=1e-9)


@pytest.mark.parametrize("kind", IDEAL)
def test_a_box_behind_the_eye_is_not_drawn(kind):
    away = ((9.0, 8.0, 12.0), (18.0, 16.0, 24.0), (0, 1, 0), 40.0)
    shown = scene(away)
    assert not len(ends_of(kind, shown)[0].pixel)
    out = emulate(shown, IDEAL[kind])
    assert not out.rgba.any()
    assert not out.samples.any()


@pytest.mark.parametrize("kind", IDEAL)
def test_rays_are_in_the_control_type_and_one_for_each_pixel(kind):
    for control in ("float16", "float32", "float64"):
        ends, _ = ends_of(kind, scene(LOOKS["oblique"]), Device("d", control=control))
        assert ends.entry.dtype == ends.exit.dtype == control
        assert len(np.unique(ends.pixel)) == len(ends.pixel)
