"""Empty air around a radar is left out, and that changes nothing."""

import dataclasses

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import volref as vr
from tests.radars import knmi
from volref.phantoms.transfer import dbz_transfer
from volref.planning import may_be_seen
from volref.scene import radar_blocks
from volref.scene.beams import world_of_beam
from volref.scene.radar_blocks import flag_bins, flag_radar
from volref.stages.polar import polar_lookup, radar_table

WIDTH, HEIGHT = 9, 7

# A radar of a few hundred metres, and one that sees over the horizon, where beams over the earth bend.
SIZES = [1.0, 100.0]

BEAMS = ["straight", "4/3-earth"]


def spotted(seed, size, beam):
    """Radials, gates, elevations (some look down, some straight up) all random; an echo here and there."""
    rng = np.random.default_rng(seed)
    tilts = [-4.0, -0.5, 0.0, 0.7, 3.0, 11.0, 40.0, 88.5, 90.0][: rng.choice([6, 7, 9])]
    tilts = np.sort(rng.choice(tilts, rng.integers(1, 6), replace=False))
    sweeps = []
    for tilt, gap in zip(tilts, np.diff(tilts, prepend=tilts[0] - 1), strict=True):
        radials, gates = int(rng.integers(1, 14)), int(rng.integers(1, 24))
        turn = (
            np.sort(rng.uniform(0, 360, radials))
            if rng.random() < 0.3
            else np.arange(radials) * 360 / radials
        )
        values = np.full((radials, gates), -np.inf)
        values[rng.random(values.shape) < 0.03] = rng.uniform(20, 60)
        values[rng.random(values.shape) < 0.05] = np.nan
        values[rng.integers(radials), rng.integers(gates)] = 30.0
        wobble = rng.uniform(-0.8, 0.0, radials) * gap * (rng.random() < 0.5)
        spacing = size * rng.uniform(20, 60)
        sweeps.append(vr.Sweep(turn, tilt + wobble, values, rng.uniform(-0.5, 3) * spacing, spacing))
    return vr.RadarVolume(sweeps, beam=beam, origin=size * rng.uniform(-900, 900, 3))


def table(low=5.0):
    return vr.TransferFunction([low, 60.0], [(0, 1, 0), (1, 0, 0)], [0.0, 2e-3])


def seen_at_random(radar, seed):
    """A scene that looks at the radar from somewhere around, or out of its own box."""
    rng = np.random.default_rng(seed)
    low, high = radar.box
    extent = float(np.linalg.norm(high - low))
    middle = (low + high) / 2
    eye = middle + rng.normal(size=3) * extent * rng.choice([0.1, 0.7, 1.5])
    if rng.random() < 0.3:
        eye[2] = radar.origin[2]  # rays within the plane of the antenna
        middle[2] = eye[2]
    camera = vr.Camera.look_at(eye, middle, (0, 0.1, 1), fov_y=50.0, near=extent / 1e3, far=extent * 9)
    return vr.Scene(radar, table(), camera, WIDTH, HEIGHT)


@settings(max_examples=50)
@given(seed=st.integers(0, 10**6), size=st.sampled_from(SIZES), beam=st.sampled_from(BEAMS))
@example(seed=94, size=1.0, beam="straight")  # one level sweep: its box has no height
def test_leaving_out_empty_air_changes_nothing(seed, size, beam):
    radar = spotted(seed, size, beam)
    plan = vr.plan(seen_at_random(radar, seed), method="march", step=radar.gate_length * (0.3 + seed % 3))
    plan = dataclasses.replace(plan, termination=0.0)
    planned, forced = (vr.render(plan.scene, plan=each, threads=1) for each in (plan, plan.everything()))
    np.testing.assert_array_equal(planned.rgba, forced.rgba)


def around_echoes(radar, rng, n):
    """Points (3, n) between the radials, gates and sweeps around gates that have an echo."""
    spots = []
    for s, sweep in enumerate(radar.sweeps):
        radial, gate = np.nonzero(sweep.values > 0)
        below, above = (radar.sweeps[k].elevation for k in (max(s - 1, 0), min(s + 1, len(radar.sweeps) - 1)))
        turn = 360 / len(sweep.azimuths)
        spots.append(
            (
                sweep.first_gate + sweep.gate_spacing * (gate + rng.uniform(-1, 1, (n, len(gate)))),
                sweep.azimuths[radial] + turn * rng.uniform(-1, 1, (n, len(gate))),
                np.where(
                    rng.random((n, len(gate))) < 0.1,  # on the sweep itself
                    sweep.elevations[radial],
                    rng.uniform(below, above, (n, len(gate))),
                ),
            )
        )
    slant, azimuth, tilt = (np.concatenate([np.ravel(spot[k]) for spot in spots]) for k in range(3))
    chosen = rng.choice(len(slant), n)
    beams = world_of_beam(np.maximum(slant, 0.0)[chosen], azimuth[chosen], tilt[chosen], radar.beam)
    return np.stack(beams) + np.array(radar.origin)[:, None]


@given(
    seed=st.integers(0, 10**6),
    size=st.sampled_from(SIZES),
    beam=st.sampled_from(BEAMS),
    share=st.sampled_from([0.0, 0.0, 0.01, 0.2]),
)
def test_whatever_is_seen_lies_in_a_flagged_block_with_all_within_reach(seed, size, beam, share):
    radar, rng = spotted(seed, size, beam), np.random.default_rng(seed)
    low, high = radar.box
    points = around_echoes(radar, rng, 4000)
    values, measured = polar_lookup(radar_table(radar), points)
    reach = share * float(np.linalg.norm(high - low))
    with pytest.MonkeyPatch.context() as patch:
        # Blocks smaller than gates: what is flagged too little is not hidden by the size of the block.
        patch.setattr(radar_blocks, "GATES_A_SIDE", 0.5)
        blocks = flag_radar(radar, reach, lambda least, greatest: may_be_seen(table(), least, greatest))
    shown = points[:, measured & (values > 5.0)]
    way = rng.normal(size=shown.shape)
    around = shown + way / np.linalg.norm(way, axis=0) * reach * rng.uniform(0, 1, shown.shape[1])
    inside = (around >= low[:, None]) & (around <= high[:, None])
    around = around[:, inside.all(axis=0)]
    x, y, z = ((around - np.array(blocks.low)[:, None]) / np.array(blocks.size)[:, None]).astype(int)
    assert blocks.seen[z, y, x].all()


@given(seed=st.integers(0, 10**6), size=st.sampled_from(SIZES), beam=st.sampled_from(BEAMS))
def test_whatever_is_seen_lies_in_a_flagged_bin(seed, size, beam):
    radar = spotted(seed, size, beam)
    points = around_echoes(radar, np.random.default_rng(seed), 2000)
    values, _ = polar_lookup(radar_table(radar), points)
    bins = flag_bins(radar, lambda least, greatest: may_be_seen(table(), least, greatest))
    within, _ = polar_lookup(radar_table(radar), points, bins)
    shown = values > 5.0
    np.testing.assert_array_equal(within[shown], values[shown])
    known = ~np.isnan(within)
    np.testing.assert_array_equal(within[known], values[known])


@pytest.mark.parametrize("beam", BEAMS)
def test_of_real_storms_little_is_sampled_and_nothing_is_lost(beam):
    storms = vr.RadarVolume(knmi().sweeps, no_echo=-31.5, beam=beam)
    camera = vr.Camera.look_at((0, -200e3, 20e3), (0, 0, 5e3), (0, 0, 1), fov_y=40.0, near=1e3, far=2e6)
    plan = vr.plan(vr.Scene(storms, dbz_transfer(), camera, 24, 15), method="march", step=1000.0)
    assert plan.includes("empty space")
    plan = dataclasses.replace(plan, termination=0.0)
    planned, forced = (vr.render(plan.scene, plan=each, threads=1) for each in (plan, plan.everything()))
    np.testing.assert_array_equal(planned.rgba, forced.rgba)
    assert planned.rgba[..., 3].max() > 0.2
    assert planned.samples < forced.samples / 8


def test_modes_that_take_every_sample_leave_no_air_out():
    camera = vr.Camera.look_at((0, -200e3, 20e3), (0, 0, 5e3), (0, 0, 1), fov_y=40.0, near=1e3, far=2e6)
    plan = vr.plan(vr.Scene(knmi(), dbz_transfer(), camera, 24, 15, mode="mip"), method="march")
    assert plan.occupancy is None
