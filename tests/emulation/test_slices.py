"""From positions to slices of an atlas: all combinations of switches against seed 001's equations 5 to 14."""

import math
from itertools import product

import numpy as np
import pytest

from volref.emulation.groups import VolumeTexture
from volref.emulation.textures.slices import slice_pair
from volref.emulation.textures.uploads import atlas_of, tiles_of
from volref.stages.textures import Texture, fetch
from volref.workspace import Workspace

RULES = {
    "slices": ("count", "last", "centers"),
    "second_slice": ("clamped", "unclamped"),
    "between": ("z", "x", "none"),
    "tile_row": ("columns", "rows", "printed"),
    "tile_column": ("fract", "mod"),
    "second_column": ("fract", "printed"),
    "first_tile": ("v0", "v1"),
    "rows": ("with-v", "against-v"),
    "in_tile": ("bleeds", "clamped"),
    "padding": (0, 2),
}

# How the parts of programs that put all slices where they belong may differ.
WORKING = [
    dict(zip(("first_tile", "rows", "tile_column", "padding", "in_tile"), words, strict=True))
    for words in product(
        ("v0", "v1"), ("with-v", "against-v"), ("fract", "mod"), (0, 1), ("bleeds", "clamped")
    )
]


def equations(rules, size, tiles, point):
    """s1, s2, share, u1, v1, u2, v2 of a point, by the chapter's equations; N slices, Mx by My tiles."""
    (nx, ny, n), (m_x, m_y), (x, y, z) = size, tiles, point
    place = {"count": z * n, "last": z * (n - 1), "centers": max(z * n - 0.5, 0.0)}[rules["slices"]]
    s1 = math.floor(place)  # eq. 5
    s2 = s1 + 1  # eq. 6
    if rules["second_slice"] == "clamped":
        s2 = min(s2, n - 1)
    share = x * n - s1 if rules["between"] == "x" else place - s1  # eq. 17
    x, y = in_tile(rules, x, nx), in_tile(rules, y, ny)
    if rules["rows"] == "against-v":
        y = 1 - y
    corners = []
    for s, second in ((s1, False), (s2, True)):
        column = (s % m_x) / m_x  # eq. 7 and 9
        if second and rules["second_column"] == "printed":
            column = s // m_x
        row = {"columns": s // m_x, "rows": s // m_y, "printed": (s % m_y) / m_y}[rules["tile_row"]]  # 8, 10
        if rules["first_tile"] == "v1":
            row = m_y - 1 - row
        corners += [column + x / m_x, row / m_y + y / m_y]  # eq. 11 to 14
    return [s1, s2, share, *corners]


def in_tile(rules, place, texels):
    if rules["in_tile"] == "clamped":
        place = min(max(place, 0.5 / texels), 1 - 0.5 / texels)
    padding = rules["padding"]
    return (place * texels + padding) / (texels + 2 * padding)


@pytest.mark.parametrize(("tiles", "every"), [((3, 2), 1), ((2, 3), 11), ((5, 1), 13)])
def test_every_combination_of_switches_is_the_chapters_equations(tiles, every):
    size = (4, 3, 5)
    # No slice's border among them: there float64 may take either side.
    points = [
        (0.03, 0.97, 0.012),
        (0.98, 0.02, 0.991),
        (0.31, 0.64, 0.47),
        (0.5, 0.5, 0.33),
        (0.7, 0.1, 0.91),
    ]
    position = np.array(points).T
    for words in list(product(*RULES.values()))[::every]:
        rules = dict(zip(RULES, words, strict=True))
        found = np.array(slice_pair(VolumeTexture("atlas", **rules), size, tiles, position))
        expected = np.array([equations(rules, size, tiles, point) for point in points]).T
        if np.abs(found - expected).max() > 1e-13:  # float64, up to 5 in size
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13, err_msg=str(rules))


def test_coordinates_are_in_the_type_of_positions_and_in_the_order_of_the_shader():
    one, across, down, count = (np.float32(number) for number in (1, 3, 3, 9))
    position = np.random.default_rng(1).random((3, 500)).astype(np.float32)
    pair = slice_pair(
        VolumeTexture("atlas", slices="count", second_slice="unclamped"), (7, 7, 9), (3, 3), position
    )
    x, y, z = position
    s1 = np.floor(z * count)
    s2 = s1 + one
    u = [s / across - np.floor(s / across) + x / across for s in (s1, s2)]
    v = [np.floor(s / across) / down + y / down for s in (s1, s2)]
    # A shader that adds the row and y before it divides, as volref's does, is one rounding beside eq. 11.
    for found, expected in zip(pair, [s1, s2, z * count - s1, u[0], v[0], u[1], v[1]], strict=True):
        assert found.dtype == np.float32
        np.testing.assert_allclose(found, expected, rtol=0, atol=2**-23)


@pytest.fixture(scope="module")
def values():
    return np.random.default_rng(2).integers(1, 256, (5, 3, 4)) / 255


def looked_up(values, rules, points, kind="linear"):
    """The mixed value (n,) at points (n, 3) of an atlas that is laid out by the same rules."""
    switches = VolumeTexture("atlas", **rules)
    tiles = tiles_of(switches, len(values))
    atlas = Texture(atlas_of(values[..., None], switches, tiles), kind)
    nz, ny, nx = values.shape
    pair = slice_pair(switches, (nx, ny, nz), tiles, np.asarray(points).T)
    one, two = (fetch(atlas, places, Workspace())[0] for places in ((pair.u1, pair.v1), (pair.u2, pair.v2)))
    return one + (two - one) * pair.share


def middles(values):
    """The places (n, 3) of all voxels in texture space, but for z, which is the slice's number; and N."""
    z, y, x = np.indices(values.shape).reshape(3, -1)
    nz, ny, nx = values.shape
    return np.stack([(x + 0.5) / nx, (y + 0.5) / ny, z], axis=-1), nz


@pytest.mark.parametrize("rules", WORKING, ids=lambda rules: "-".join(map(str, rules.values())))
@pytest.mark.parametrize("slices", ["count", "last", "centers"])
def test_a_voxels_own_place_has_the_voxels_own_value(values, slices, rules):
    points, count = middles(values)
    at = {"count": points[:, 2] / count, "last": points[:, 2] / (count - 1)}
    points[:, 2] = at.get(slices, (points[:, 2] + 0.5) / count)
    found = looked_up(values, {"slices": slices, **rules}, points)
    # The place of a texel is rounded: 1e-14 of a texel.
    np.testing.assert_allclose(found, values.reshape(-1), rtol=0, atol=1e-13)


@pytest.mark.parametrize("rules", WORKING, ids=lambda rules: "-".join(map(str, rules.values())))
@pytest.mark.parametrize("slices", ["count", "last", "centers"])
def test_values_are_continuous_where_one_slice_follows_the_next(values, slices, rules):
    rng, count = np.random.default_rng(3), len(values)
    x, y = rng.random((2, 40))
    for border in range(1, count - (slices == "last")):
        z = {"count": border / count, "last": border / (count - 1)}.get(slices, (border + 0.5) / count)
        sides = [
            looked_up(values, {"slices": slices, **rules}, np.stack([x, y, 0 * x + z + d], -1))
            for d in (-1e-9, 1e-9)
        ]
        # Values of 0..1 change by at most `count` per unit of z: 1e-8 over 2e-9.
        np.testing.assert_allclose(*sides, rtol=0, atol=2e-8)


@pytest.mark.parametrize("slices", ["count", "centers"])
def test_behind_the_last_slice_a_clamped_atlas_goes_on_and_another_fades_into_an_empty_tile(values, slices):
    last, middle = values[-1, 1, 1], (1.5 / 4, 0.5)
    ends = [
        looked_up(values, {"slices": slices, "second_slice": word}, [(*middle, 1 - 1e-12)])[0]
        for word in ("clamped", "unclamped")
    ]
    # Five slices in six tiles: the sixth is 0.  Slice i lies at i / 5, so all of the last fifth fades, or at
    # (i + 1/2) / 5, where half of it is left.
    np.testing.assert_allclose(ends, [last, 0.0 if slices == "count" else last / 2], rtol=0, atol=1e-10)


def test_before_the_first_centre_there_is_the_first_slice_alone(values):
    found = looked_up(values, {"slices": "centers"}, [(1.5 / 4, 0.5, z) for z in (0.0, 0.05, 0.0999)])
    np.testing.assert_allclose(found, values[0, 1, 1], rtol=0, atol=1e-13)


def test_an_atlas_that_bleeds_mixes_in_its_neighbour_tiles_half_a_texel_from_their_border():
    # Slice 0 is 1, all others 0: 3 x 2 tiles.
    only = np.zeros((5, 3, 4))
    only[0] = 1.0
    inside, left, bottom = (0.5, 0.5, 0.1), (1 - 1e-9, 0.5, 0.1), (0.5, 1 - 1e-9, 0.1)
    points = [inside, left, bottom]
    bleeding = looked_up(only, {"slices": "centers"}, points)
    # Half of a texel beyond the tile's side is the neighbour's, whose values are 0.
    np.testing.assert_allclose(bleeding, [1.0, 0.5, 0.5], rtol=0, atol=1e-7)
    for cure in ({"in_tile": "clamped"}, {"padding": 1}):
        np.testing.assert_allclose(looked_up(only, cure, points), 1.0, rtol=0, atol=1e-7)


@pytest.mark.parametrize("cure", [{"in_tile": "clamped"}, {"padding": 1}, {"padding": 3}])
@pytest.mark.parametrize("rows", ["with-v", "against-v"])
def test_an_atlas_that_does_not_bleed_is_a_3d_texture_clamped_to_its_edge(values, rows, cure):
    points = np.random.default_rng(4).random((300, 3))
    points[:80] = np.round(points[:80])
    points[80:160, :2] = np.round(points[80:160, :2])
    found = looked_up(values, {"slices": "centers", "rows": rows, **cure}, points)
    expected = fetch(Texture(values[..., None]), points.T, Workspace())[0]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13)
