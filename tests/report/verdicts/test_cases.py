import dataclasses

import numpy as np
import pytest

from tests.report import cases
from volref import SceneError
from volref.report.verdicts.cases import Case


@pytest.mark.parametrize(
    ("make", "kind"),
    [
        (cases.passing, "pass"),
        (cases.failing, "fail"),
        (cases.warning, "warn"),
        (cases.open_case, "open"),
        (cases.unjustified, "pass"),
        (cases.floating, "fail"),
        (cases.opaque_colors, "fail"),
    ],
)
def test_what_came_of_a_case_is_what_its_verdict_says(make, kind):
    assert make().kind == kind


def test_a_verdict_on_another_size_is_refused():
    with pytest.raises(
        SceneError, match=r"verdict must be on an image of 24 x 20 pixels .* got 12 x 10; judge"
    ):
        Case(
            "x", cases.passing().acceptance, cases.failing(size=(20, 24)).verdict.__class__(**small_verdict())
        )


def small_verdict():
    verdict = cases.passing().verdict
    fields = {field.name: getattr(verdict, field.name) for field in dataclasses.fields(verdict)}
    return fields | {"outside": fields["outside"][:10, :12]}


def test_a_counterfactual_of_another_size_is_refused():
    case = cases.passing()
    why = cases.why((), "", np.zeros((5, 6, 4)), case.verdict)
    with pytest.raises(SceneError, match=r"counterfactual must be .* got 6 x 5;"):
        dataclasses.replace(case, explanation=why)


def test_without_an_alpha_the_nominal_one_is_shown():
    case = cases.opaque_colors()
    assert not case.judges_alpha
    np.testing.assert_array_equal(case.candidate[..., 3], case.acceptance.nominal[..., 3])
    np.testing.assert_array_equal(case.candidate[..., :3], case.verdict.candidate)
