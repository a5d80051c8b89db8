"""Probes drawn by real WebGL: the implementation is known again, and its images pass on the device found."""

import pytest

from tests.webgl.faulty import system_of
from volref.golden.probing.catalogue import DELIVERY, PROBES
from volref.golden.probing.judging import fingerprint

# What was measured of them by other means, see test_devices.py.
TOLD = {
    "swiftshader": {"filter": (None, None), "subpixel_bits": 4, "blend": "float", "srgb": "curve"},
    "llvmpipe": {"filter": (8, 8), "subpixel_bits": 8, "blend": "integer", "srgb": "cubic"},
}


@pytest.fixture(scope="module")
def found(webgl):
    images = {}
    for probe in (DELIVERY, *PROBES.values()):
        subject = probe.subject()
        images[probe.name] = system_of(subject.pipeline).draw(webgl, subject.scene, subject.pipeline)[
            "canvas"
        ]
    return fingerprint(images)


def test_a_machine_is_known_by_what_it_draws(webgl, found):
    print({name: (one.facts, one.outside[one.nearest]) for name, one in found.findings.items()})
    told = TOLD[webgl.name]
    facts = {name: one.facts for name, one in found.findings.items()}
    assert (facts["filter"]["weight_bits"], facts["filter"]["result_bits"]) == told["filter"]
    assert facts["raster"]["subpixel_bits"] == told["subpixel_bits"]
    assert facts["blend"] == {"blend": told["blend"]}
    assert facts["srgb"] == {"srgb": told["srgb"]}
    assert found.machines == (webgl.name,)


def test_a_clean_program_is_known_by_what_it_draws(found):
    assert found.way is not None
    assert (found.way.first_row, found.way.alpha, found.way.encoding) == ("top", "premultiplied", "none")
    assert "at v" in found.findings["table"].facts["table"]
    assert "half a voxel beyond" in found.findings["grid"].facts["grid"]
    assert "rays end at an alpha of 0.999" in found.findings["termination"].fitting


def test_images_pass_on_the_device_that_they_led_to(found):
    assert found.settled, found.confirmed
