"""Probes: emulated machines and programs are known again by what they draw."""

import dataclasses
import json

import numpy as np
import pytest

import volref as vr
from volref.cli import main
from volref.emulation.device import Device
from volref.golden.probing.catalogue import DELIVERY, PROBES
from volref.golden.probing.files import answers_in, write_probes
from volref.golden.probing.judging import Way, fingerprint
from volref.image import straight_from_premultiplied

EVERY = (DELIVERY, *PROBES.values())
AS_DRAWN = Way("top", "premultiplied", "none")


def drawn(subject):
    return vr.emulate(subject.scene, subject.pipeline, subject.device).rgba8


def answers(device, *names, **readings):
    """What a machine draws of the probes of these names; by a program that is as a reading says."""
    images = {DELIVERY.name: drawn(DELIVERY.subject(device))}
    for name in names:
        subject = PROBES[name].subject(device)
        if name in readings:
            subject = next(r for r in PROBES[name].readings if readings[name] in r.label).applied(subject)
        images[name] = drawn(subject)
    return images


MACHINE = ("filter", "raster", "blend", "output", "srgb")


@pytest.mark.parametrize("name", ["swiftshader", "lavapipe"])  # llvmpipe: tests/webgl/test_probe.py
def test_a_machine_is_known_by_its_images_and_they_pass_on_the_device_found(name):
    machine = Device.named(name)
    found = fingerprint(answers(machine, *MACHINE))
    assert found.way == AS_DRAWN
    for finding in found.findings.values():
        for field, value in finding.facts.items():
            assert getattr(machine, field) == value
    for probe in ("filter", "blend", "srgb"):
        assert len(found.findings[probe].fitting) == 1
    assert found.findings["raster"].facts["subpixel_bits"] == machine.subpixel_bits
    assert found.machines == (name,)
    assert found.device == dataclasses.replace(machine, name="probed")
    assert found.settled


@pytest.mark.parametrize(("bits", "known"), [(7, True), (5, False)])
def test_weights_of_bits_that_are_listed_are_told_and_of_others_it_is_said_that_none_fits(bits, known):
    machine = Device("odd", weight_bits=bits)
    finding = fingerprint(answers(machine, "filter")).findings["filter"]
    assert finding.facts == ({"weight_bits": bits, "result_bits": None} if known else {})
    assert bool(finding.fitting) == known
    assert min(finding.outside.values()) == finding.outside[finding.nearest]


def test_what_is_unknown_stays_free_in_the_device():
    found = fingerprint(answers(Device("odd", weight_bits=5), "filter"))
    free = Device.named("webgl-highp")
    assert not found.settled
    assert found.machines == ()
    assert found.device == dataclasses.replace(free, name="probed")


@pytest.mark.parametrize(
    ("probe", "reading"),
    [
        ("table", "(v (n - 1) + 1/2) / n"),
        ("table", "nearest entry"),
        ("grid", "outer voxels' centres"),
        ("grid", "first voxel's centre"),
        ("grid", "box's corner"),
        ("termination", "alpha of 0.95"),
        ("termination", "alpha of 0.99"),
    ],
)
def test_a_program_is_known_by_its_images(probe, reading):
    found = fingerprint(answers(Device.named("swiftshader"), probe, **{probe: reading}))
    (label,) = found.findings[probe].fitting
    assert reading in label
    assert found.settled


def test_an_alpha_that_ends_no_ray_that_is_seen_stays_unknown():
    finding = fingerprint(answers(Device(), "termination")).findings["termination"]
    assert finding.fitting[-2:] == ("rays end at an alpha of 0.999", "rays are never ended by their alpha")
    assert finding.facts == {}


def straight(image):
    numbers = straight_from_premultiplied(image / 255)
    return np.rint(255 * np.clip(numbers, 0, 1)).astype(np.uint8)


@pytest.mark.parametrize(
    ("got_out", "way"),
    [
        (lambda image: image[::-1], Way("bottom", "premultiplied", "none")),
        (straight, Way("top", "straight", "none")),
        (lambda image: straight(image)[::-1], Way("bottom", "straight", "none")),
        (lambda image: image / np.float32(255), AS_DRAWN),
    ],
)
def test_how_images_got_out_is_found_and_undone(got_out, way):
    images = {name: got_out(image) for name, image in answers(Device.named("swiftshader"), "blend").items()}
    found = fingerprint(images)
    assert found.way == way
    assert found.findings["blend"].facts == {"blend": "float"}


def test_images_of_something_else_tell_nothing():
    noise = np.random.default_rng(1).integers(0, 256, (40, 48, 4), np.uint8)
    found = fingerprint({"delivery": noise, "filter": noise})
    assert (found.way, found.findings, found.machines, found.settled) == (None, {}, (), False)


@pytest.mark.parametrize("probe", EVERY, ids=lambda probe: probe.name)
def test_the_readings_of_a_probe_are_drawn_differently(probe):
    """But for those that no image tells, and they are listed."""
    alike = {
        ("rays end at an alpha of 0.999", "rays are never ended by their alpha"),
    }
    images = {one.label: drawn(one.applied(probe.subject())) for one in probe.readings}
    labels = list(images)
    for i, one in enumerate(labels):
        for other in labels[i + 1 :]:
            assert np.array_equal(images[one], images[other]) == ((one, other) in alike), (one, other)


@pytest.mark.parametrize(
    ("images", "words"),
    [
        ({"filter": np.zeros((40, 48, 4))}, "must hold the probe 'delivery'"),
        ({"delivery": np.zeros((40, 48, 4)), "sound": np.zeros((40, 48, 4))}, "got 'sound'"),
        ({"delivery": np.zeros((80, 96, 4))}, "must be 48 x 40 pixels, got 96 x 80"),
    ],
)
def test_answers_that_are_none_are_refused(images, words):
    with pytest.raises(vr.SceneError, match=words):
        fingerprint(images)


def run(capsys, *words):
    status = main([str(word) for word in words])
    out, err = capsys.readouterr()
    return status, out, err


@pytest.fixture(scope="module")
def probes(tmp_path_factory):
    folder = tmp_path_factory.mktemp("probes")
    write_probes(folder)
    return folder


def test_the_command_reads_answers_beside_the_scenes_and_writes_a_device(probes, tmp_path, capsys):
    for name, image in answers(Device.named("swiftshader"), "filter", "blend").items():
        np.save(probes / name / "answer.npy", image)
    status, out, _ = run(capsys, "probe", "judge", probes, "-o", tmp_path / "mine.json", "--json")
    found = json.loads(out)
    assert (status, found["machines"]) == (0, ["swiftshader"])
    assert found["findings"]["filter"]["facts"] == {"weight_bits": None, "result_bits": None}
    assert vr.load_device(tmp_path / "mine.json").subpixel_bits == 4
    _, out, _ = run(capsys, "probe", "judge", probes)
    assert out.splitlines()[0] == "delivery     first row at the top, alpha premultiplied, encoding none"
    assert out.splitlines()[-1].endswith("all inside its own intervals")


def test_every_probe_is_written_as_a_scene(probes):
    assert sorted(path.parent.name for path in probes.glob("*/scene.json")) == sorted(p.name for p in EVERY)


def test_a_folder_without_answers_or_with_two_is_refused(tmp_path, capsys):
    assert run(capsys, "probe", "judge", tmp_path)[0] == 2
    (tmp_path / "blend").mkdir()
    for suffix in (".png", ".npy"):
        (tmp_path / "blend" / f"answer{suffix}").write_bytes(b"")
    with pytest.raises(vr.FormatError, match="must hold one answer"):
        answers_in(tmp_path)
