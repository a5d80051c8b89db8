import hashlib

import numpy as np

import volref as vr
from tests.scenes import rough_scene
from volref.oracle.faults.fault import Subject
from volref.report.verdicts.making import case_of


def test_a_case_has_the_targets_of_its_program_the_hashes_of_its_files_and_the_error_of_its_truth(tmp_path):
    scene = rough_scene(8, 6)
    subject = Subject(scene, vr.pipelines()["congote2012"], vr.Device())
    out = vr.emulate(scene, "congote2012")
    accepted = vr.accept(scene, "congote2012")
    np.save(tmp_path / "mine.npy", out.rgba8)
    verdict = vr.check(tmp_path / "mine.npy", accepted)
    truth = vr.render(scene)
    case = case_of(
        "mine", accepted, verdict, subject=subject, truth=truth, files={"candidate": tmp_path / "mine.npy"}
    )
    assert list(case.passes) == list(out.passes)
    np.testing.assert_array_equal(case.passes["canvas"], out.rgba)
    digest = hashlib.sha256((tmp_path / "mine.npy").read_bytes()).hexdigest()
    assert case.provenance["sha256 of the candidate"] == digest
    told = case.provenance["plan of the truth"].splitlines()
    assert told[0] == f"method {truth.plan.method}"
    assert [line.partition(": ")[2] for line in told[1:]] == [stage.reason for stage in truth.plan.stages]
    assert [", left out: " in line for line in told[1:]] == [not s.included for s in truth.plan.stages]
    bound = float(case.provenance["error of the truth"].removeprefix("at most ").partition("/")[0])
    # told with three digits, rounded up
    assert truth.bound.max() * 255 <= bound <= truth.bound.max() * 255 * 1.01
    assert "(certified)" in case.provenance["error of the truth"]


def test_of_what_is_not_at_hand_nothing_is_told():
    codes = np.full((3, 3, 4), 100, np.uint8)
    chosen = vr.Acceptance.unjustified(codes, 0)
    case = case_of("mine", chosen, vr.check(codes, chosen))
    assert (dict(case.passes), dict(case.provenance)) == ({}, {})
