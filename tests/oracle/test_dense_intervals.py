"""Intervals of programs whose opacities exceed 1, as those that scale them by a length do."""

import dataclasses

import volref as vr
from volref.golden.recipe import subject_of
from volref.golden.suite import load_suite


def test_an_alpha_above_1_lies_in_its_interval_before_the_canvas_rounds():
    subject = subject_of(load_suite("volref").recipes["congote2012-radar-thunderstorm"])
    scene = dataclasses.replace(subject.scene, width=32, height=24)
    program = subject.pipeline.with_switches(output={"format": "exact"})
    drawn = vr.emulate(scene, program, subject.device).rgba
    assert drawn[..., 3].max() > 1.1, "or this is about nothing"
    accepted = vr.accept(scene, program, subject.device)
    assert (accepted.raw_lo <= drawn).all()
    assert (drawn <= accepted.raw_hi).all()
