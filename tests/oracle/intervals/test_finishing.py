"""From fragments to the canvas: any fragment inside goes to a number inside, by every way there is."""

import dataclasses

import numpy as np
import pytest

import volref as vr
from tests.emulation.scenes import example
from volref.emulation.drawing import prepare
from volref.emulation.groups import Accumulation, Output
from volref.oracle.intervals.finishing import averaged, finished, fragments_of, rounded, shown
from volref.oracle.intervals.slack import slack_of
from volref.oracle.intervals.walking import Pair
from volref.tonemap import OPERATORS

COUNT, MEMBERS = 60, 40
BACKGROUND = (0.3, 0.2, 0.1, 0.6)

# The rounding of the sums that this file itself makes.
FLOAT64 = 1e-12

BLENDS = ("none", "premultiplied", "straight", "additive-alpha", "shader", "shader-straight", "environment")
MAPS = {
    "none": {},
    "reinhard": {"tone_map": "reinhard"},
    "artistic": {"tone_map": "artistic", "low": 0.1, "mid": 0.4, "high": 1.3, "saturation": 1.4},
    "gamma": {"gamma": 2.2},
    "both": {"tone_map": "reinhard", "gamma": 2.2},
}


def drawing_of(**output):
    scene = dataclasses.replace(example(), width=2, height=2, background=BACKGROUND)
    pipeline = vr.pipelines()["texture3d"].with_switches(output=output, meshes={"kind": "none"})
    return prepare(scene, pipeline, vr.Device("one"))


def boxes(rng, *, most=1.2, wide=0.25):
    """Fragments (F, 4), least and greatest; a third of them known but for a millionth."""
    low = rng.uniform(0, most, (COUNT, 4))
    low[:, 3] = rng.uniform(0, 1, COUNT)
    width = np.where(rng.random((COUNT, 1)) < 0.3, 1e-6, wide) * rng.random((COUNT, 4))
    high = low + width
    high[:, 3] = np.minimum(high[:, 3], 1.0)
    return Pair(low, np.maximum(high, low))


def inside(rng, pair):
    """One member of each: anywhere, or at an end."""
    share = rng.choice([0.0, 1.0, -1.0], pair.low.shape)
    share = np.where(share < 0, rng.random(pair.low.shape), share)
    return pair.low + share * (pair.high - pair.low)


def mapped(color, output):
    """What the shader makes of a fragment's colour, from the words of the switches."""
    light, alpha = color[:, :3].copy(), color[:, 3:].copy()
    if output.tone_map == "reinhard":
        light = light / (1 + light)
    elif output.tone_map == "artistic":
        curve, usual = OPERATORS["artistic"]
        light = curve(light, {name: getattr(output, name) for name in usual})
    if output.blend.startswith("shader"):
        front = alpha * light if output.blend == "shader-straight" else light
        light, alpha = front + (1 - alpha) * np.array(BACKGROUND[:3]) ** output.gamma, np.ones_like(alpha)
    if output.gamma != 1:
        light = np.maximum(light, 0) ** (1 / output.gamma)
    return np.concatenate([light, alpha], axis=1)


def blended(color, behind, blend):
    """What the blend state makes of it."""
    alpha = color[:, 3:]
    if blend == "premultiplied":
        return color + (1 - alpha) * behind
    if blend == "straight":
        return color * alpha + behind * (1 - alpha)
    if blend == "additive-alpha":
        mixed = color * alpha + behind * (1 - alpha)
        return np.concatenate([mixed[:, :3], color[:, 3:] + behind[:, 3:]], axis=1)
    return color


def blended_in_bytes(color, behind, blend):
    """The same as Mesa has it: bytes, whose products are rounded one by one."""
    one, two = (np.rint(255 * np.clip(side, 0, 1)).astype(np.int64) for side in (color, behind))
    alpha = one[:, 3:]

    def product(a, b):
        found = a * b
        return (found + (found >> 8) + 128) >> 8

    front = one if blend == "premultiplied" else product(one, alpha)
    back = product(two, 255 - alpha)
    if blend == "additive-alpha":
        front[:, 3], back[:, 3] = one[:, 3], two[:, 3]
    return np.minimum(front + back, 255) / 255


@pytest.mark.parametrize("way", MAPS)
@pytest.mark.parametrize("blend", BLENDS)
def test_fragments_inside_leave_numbers_inside(blend, way):
    drawing = drawing_of(blend=blend, format="float", **MAPS[way])
    output, rng = drawing.pipeline.output, np.random.default_rng(4)
    fragments = boxes(rng)
    alpha = Pair(fragments.low[:, 3].copy(), fragments.high[:, 3].copy())
    behind = rng.random((COUNT, 4))
    found = finished(drawing, fragments, alpha, behind, slack_of(vr.Device.named("exact")), mapped=True)
    for _ in range(MEMBERS):
        color = inside(rng, fragments)
        if blend == "environment":
            # What is accumulated decides how much of it is seen; all of the fragment is there already.
            color = color + np.maximum(1 - inside(rng, Pair(*(side[:, None] for side in alpha))), 0) * behind
        image = blended(mapped(color, output), behind, blend)
        assert (image >= found.low - FLOAT64).all()
        assert (image <= found.high + FLOAT64).all()


@pytest.mark.parametrize("blend", ["premultiplied", "straight", "additive-alpha"])
def test_so_do_those_that_blend_in_whole_numbers(blend):
    drawing = drawing_of(blend=blend, format="unorm8")
    drawing = dataclasses.replace(drawing, device=dataclasses.replace(drawing.device, blend="integer"))
    rng = np.random.default_rng(5)
    for wide in (0.25, 0.01):
        fragments = boxes(rng, most=1.0, wide=wide)
        fragments = Pair(*(np.clip(side, 0, 1) for side in fragments))
        alpha = Pair(fragments.low[:, 3], fragments.high[:, 3])
        behind = np.rint(255 * rng.random((COUNT, 4))) / 255
        slack = slack_of(vr.Device.named("exact"))
        found = finished(drawing, fragments, alpha, behind, slack, mapped=True)
        for _ in range(6 * MEMBERS):
            image = blended_in_bytes(inside(rng, fragments), behind, blend)
            assert (image >= found.low - FLOAT64).all()
            assert (image <= found.high + FLOAT64).all()


def test_the_least_alpha_of_straight_blending_lies_between_its_ends():
    drawing = drawing_of(blend="straight", format="float")
    ends = Pair(np.array([[0.0, 0.0, 0.0, 0.1]]), np.array([[0.0, 0.0, 0.0, 0.9]]))
    behind = np.array([[0.0, 0.0, 0.0, 1.0]])
    found = finished(
        drawing,
        ends,
        Pair(ends.low[:, 3], ends.high[:, 3]),
        behind,
        slack_of(vr.Device.named("exact")),
        mapped=True,
    )
    # a a + 1 - a is .91 at both ends and .75 at a half.
    np.testing.assert_allclose([found.low[0, 3], found.high[0, 3]], [0.75, 0.91], rtol=0, atol=1e-12)


def test_fragments_that_may_be_discarded_may_leave_what_was_there():
    drawing = drawing_of(blend="none", format="float", discard_below=0.5)
    low = np.array([[0.9, 0.9, 0.9, alpha] for alpha in (0.2, 0.4, 0.6)])
    high = low + np.array((0.0, 0.0, 0.0, 0.15))
    behind = np.full((3, 4), 0.1)
    found = finished(
        drawing,
        Pair(low, high),
        Pair(low[:, 3], high[:, 3]),
        behind,
        slack_of(vr.Device.named("exact")),
        mapped=True,
    )
    assert found.low[:, 0].tolist() == [0.1, 0.1, 0.9]
    assert found.high[:, 0].tolist() == [0.1, 0.9, 0.9]


@pytest.mark.parametrize("normalize", ["none", "above-one", "always"])
@pytest.mark.parametrize("alpha", ["accumulated", "weighted", "one"])
def test_what_shaders_have_after_their_loops_is_inside(normalize, alpha):
    rng = np.random.default_rng(6)
    channels = 5 if alpha == "weighted" else 4
    weight = rng.uniform(0, 1.6 if normalize == "above-one" else 1.0, COUNT)
    weight[:10] = 0.0
    straight = rng.random((3, COUNT))
    low = np.concatenate([straight * weight * 0.9, rng.random((channels - 4, COUNT)), weight[None] * 0.9])
    high = low * 1.3
    high[:, :20] += 0.05
    rule = Accumulation(rule="add-alpha", normalize=normalize, alpha=alpha)
    found = fragments_of(low, high, rule, 1.0)
    for _ in range(4 * MEMBERS):
        one = inside(rng, Pair(low, high))
        color, total = one[:3], one[-1]
        if normalize == "always":
            # No sum of weighted colours up to 1 exceeds the sum of the weights.
            color = np.minimum(color, total)
            color = np.divide(color, total, out=np.zeros_like(color), where=total > 0)
        elif normalize == "above-one":
            color = color / np.maximum(total, 1)
        own = {"accumulated": total, "weighted": one[3], "one": np.ones(COUNT)}[alpha]
        expected = np.concatenate([color, own[None]]).T
        assert (expected >= found.low - FLOAT64).all()
        assert (expected <= found.high + FLOAT64).all()


@pytest.mark.parametrize("device", ["ideal", "webgl-highp"])
@pytest.mark.parametrize("kind", ["unorm8", "unorm16", "half", "float", "exact"])
def test_numbers_between_two_are_stored_between_two(kind, device):
    machine, rng = vr.Device.named(device), np.random.default_rng(7)
    pair = boxes(rng)
    found = rounded(pair, kind, machine, blends=True)
    most = {"unorm8": 255, "unorm16": 65535}.get(kind)
    for _ in range(MEMBERS):
        number = inside(rng, pair)
        if most:
            # A byte may be rounded by .6 of a step, a blended one by 1.33 more.
            slack = machine.store_slack + machine.blend_slack if kind == "unorm8" else 0.0
            code = np.float32(most) * number.astype(np.float32) + rng.uniform(-slack, slack, number.shape)
            number = np.clip(np.rint(code), 0, most) / most
        elif kind == "half":
            number = number.astype(np.float16).astype(np.float64)
        elif kind == "float":
            number = number.astype(np.float32).astype(np.float64)
        assert (number >= found.low - FLOAT64).all()
        assert (number <= found.high + FLOAT64).all()


@pytest.mark.parametrize("mean_format", ["unorm8", "float"])
def test_running_means_of_frames_inside_are_inside(mean_format):
    output, rng = Output(mean_format=mean_format), np.random.default_rng(8)
    machine = vr.Device("one")
    mean = Pair(np.zeros((COUNT, 4)), np.zeros((COUNT, 4)))
    means = np.zeros((MEMBERS, COUNT, 4), np.float32)
    for number in range(1, 9):
        frame = Pair(*(np.rint(255 * np.clip(side, 0, 1)) / 255 for side in boxes(rng, wide=0.02)))
        mean = averaged(mean, frame, number, output, machine)
        for k in range(MEMBERS):
            now = np.rint(255 * inside(rng, frame)) / 255
            share = np.float32(1 / number)
            if k % 2:
                means[k] = means[k] * (1 - share) + now.astype(np.float32) * share
            else:
                means[k] = means[k] + (now.astype(np.float32) - means[k]) * share
            if mean_format == "unorm8":
                means[k] = np.rint(np.float32(255) * means[k]) / np.float32(255)
            # A byte as float32 has it.
            assert (means[k] >= mean.low - 2.0**-23).all()
            assert (means[k] <= mean.high + 2.0**-23).all()


@pytest.mark.parametrize("way", MAPS)
def test_a_mean_that_is_shown_is_inside(way):
    drawing = drawing_of(blend="none", format="float", mean_format="float", **MAPS[way])
    rng = np.random.default_rng(9)
    mean = boxes(rng)
    found = shown(drawing, mean, slack_of(vr.Device.named("exact")), drawing.scene)
    for _ in range(MEMBERS):
        image = mapped(inside(rng, mean), drawing.pipeline.output)
        assert (image >= found.low - FLOAT64).all()
        assert (image <= found.high + FLOAT64).all()
