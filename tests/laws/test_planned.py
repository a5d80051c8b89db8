"""What a plan leaves out changes nothing: every scene drawn equals itself with everything forced in.

Bit for bit where only empty space and equal colour channels are left out; within the stated part of the bound
where rays end early, colours follow from the weights, or float32 does the sums.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import volref as vr
from tests.scenes import camera_towards
from volref.phantoms.meshes import sphere_mesh

UNIT = st.floats(0, 1, width=16)
SHADES = st.sampled_from(["three", "grey", "white", "two equal", "blue constant"])


@st.composite
def volumes(draw):
    """Independent voxels, an island in an empty volume, a ramp, or one value."""
    shape = draw(st.sampled_from([(5, 6, 7), (12, 9, 14), (3, 20, 4), (2, 2, 2)]))
    kind = draw(st.sampled_from(["rough", "island", "ramp", "one value"]))
    rng = np.random.default_rng(draw(st.integers(0, 99)))
    values = np.zeros(shape)
    if kind == "rough":
        values = rng.random(shape)
    elif kind == "island":
        z, y, x = (rng.integers(0, n) for n in shape)
        values[z : z + 2, y : y + 2, x : x + 2] = 1.0
    elif kind == "ramp":
        values = np.broadcast_to(np.linspace(0, 1, shape[2]), shape).copy()
    else:
        values += draw(UNIT)
    dtype = draw(st.sampled_from([np.uint8, np.int16, np.float32, np.float64]))
    scale = 200 if np.dtype(dtype).kind in "iu" else 1.0
    return vr.Volume(
        (values * scale).astype(dtype),
        spacing=draw(st.sampled_from([(1, 1, 1), (0.5, 1, 2)])),
        origin=draw(st.sampled_from([(0, 0, 0), (3, -40, 11)])),
        centering=draw(st.sampled_from(["cell", "node"])),
    )


@st.composite
def tables(draw, volume):
    """Piecewise linear tables with plateaus, jumps and clear parts, in every kind of colour."""
    count = draw(st.integers(1, 6))
    low, high = volume.value_bounds
    places = sorted(draw(st.lists(UNIT, min_size=count, max_size=count)))
    places = [place for k, place in enumerate(places) if places[:k].count(place) < 2]  # a jump has two
    count = len(places)
    values = [low - 0.1 + place * (high - low + 0.2) for place in places]
    strengths = draw(st.lists(st.sampled_from([0.0, 0.0, 0.2, 0.9]), min_size=count, max_size=count))
    colors = np.array(draw(st.lists(st.tuples(UNIT, UNIT, UNIT), min_size=count, max_size=count)))
    shade = draw(SHADES)
    if shade == "grey":
        colors[:] = colors[:, :1]
    elif shade == "white":
        colors[:] = 1.0
    elif shade == "two equal":
        colors[:, 2] = colors[:, 0]
    elif shade == "blue constant":
        colors[:, 2] = 0.3
    if draw(st.booleans()):
        return vr.TransferFunction(values, colors, [4 * s for s in strengths])
    return vr.TransferFunction(values, colors, opacity=strengths, unit_distance=draw(st.floats(0.3, 3)))


@st.composite
def cameras(draw, volume):
    """Views from outside, along an axis, in parallel, and from within."""
    center = volume.corners.mean(axis=0)
    size = float(np.linalg.norm(volume.corners[-1] - volume.corners[0]))
    direction = np.array(draw(st.sampled_from([(1.1, 0.7, 0.9), (0, 1, 0), (-0.3, 0.2, 1)])))
    kind = draw(st.sampled_from(["outside", "parallel", "inside"]))
    if kind == "outside":
        return camera_towards(volume, direction)
    if kind == "parallel":
        return vr.Camera.orthographic(center + size * direction, center, (0.1, 0.2, 1.3), size, 0.0, 9 * size)
    return vr.Camera.look_at(center, center + direction, (0.1, 0.2, 1.3), 80.0, size / 100, 9 * size)


@st.composite
def scenes(draw):
    volume = draw(volumes())
    meshes = []
    if draw(st.booleans()):
        meshes = [sphere_mesh(1.1, volume.corners.mean(axis=0), colors=(0.2, 0.9, 0.4), subdivisions=1)]
    background = draw(st.sampled_from([(0, 0, 0, 0), (0.1, 0.2, 0.3, 0.5), (1, 1, 1, 1)]))
    return vr.Scene(
        volume, draw(tables(volume)), draw(cameras(volume)), 9, 7, meshes=meshes, background=background
    )


@given(scene=scenes(), step=st.sampled_from([None, 0.11, 1.7]), tolerance=st.sampled_from([1.0, 1e-2, 1e-12]))
@settings(max_examples=300, deadline=None)
def test_a_planned_march_is_the_forced_one(scene, step, tolerance):
    plan = vr.plan(scene, method="march", step=step, tolerance=tolerance)
    everything = plan.everything()
    planned, forced = vr.render(scene, plan=plan, threads=1), vr.render(scene, plan=everything, threads=1)
    difference = np.abs(planned.rgba - forced.rgba).max()
    np.testing.assert_array_equal(planned.distance, forced.distance)
    assert planned.samples <= forced.samples
    if plan.precision == "float64" and plan.termination == 0 and -1 not in plan.palette.source:
        assert difference == 0
        return
    segments = plan.most_segments + 3
    rounding = plan.rounding + segments * (np.finfo(plan.precision).eps + np.finfo(float).eps)
    # The least that the bound allows for these, whatever the estimate is.
    assert difference <= (rounding + plan.termination) * max(scene.transfer.colors.max(), 1.0)
    assert (np.abs(planned.rgba - forced.rgba).max(axis=-1) <= planned.bound + forced.bound).all()


@pytest.mark.slow
@given(scene=scenes(), tolerance=st.sampled_from([1e-2, 1e-6, 1e-11]))
@settings(max_examples=300, deadline=None)
def test_a_planned_integral_is_the_forced_one_within_both_certificates(scene, tolerance):
    plan = vr.plan(scene, method="exact", tolerance=tolerance)
    planned = vr.render(scene, plan=plan, threads=1)
    forced = vr.render(scene, plan=plan.everything(), threads=1)
    difference = np.abs(planned.rgba - forced.rgba).max(axis=-1)
    assert (difference <= planned.bound + forced.bound).all()
    assert planned.samples <= forced.samples
