"""The program that the guide shows draws what volref says, and gets the verdict that the guide says."""

import numpy as np
import pytest

import volref as vr
from tests.docs.pages import DOCS, captioned_files
from tests.emulation.scenes import example

PAGE = DOCS / "guide" / "browsers.md"

JUDGED = """
    const { judge } = await import("/files/draw.js");
    const canvas = document.createElement("canvas");
    const { capture, verdict } = await judge(canvas, "/files/guide");
    const { notes } = capture.metadata;
    return { verdict: { ...verdict, excess: null }, data: Array.from(capture.data), notes };
"""


@pytest.fixture(scope="module")
def bundle(page):
    """The golden that the guide's program draws, where the page finds it."""
    [(name, text)] = captioned_files(PAGE).items()
    (page.files / name).write_text(text.replace("./volref/", "/web/"), encoding="utf-8")
    scene = example(opacity=0.9)
    return vr.load_bundle(vr.write_bundle(page.files / "guide", scene, "texture3d", "swiftshader"))


def test_the_program_of_the_guide_is_inside(page, bundle):
    answer = page.run(JUDGED)
    assert answer["verdict"]["message"].startswith("inside: all ")
    assert answer["notes"] == []
    drawn = np.array(answer["data"], np.uint8).reshape(bundle.acceptance.lo.shape)
    assert vr.check_bundle(bundle, drawn).message == answer["verdict"]["message"]
    assert answer["verdict"]["judged"] > 100


def test_a_mistake_in_the_program_of_the_guide_is_outside(page, bundle):
    file = page.files / "draw.js"
    right = file.read_text(encoding="utf-8")
    wrong = right.replace("(float(i) + 0.5 * share)", "float(i)")
    assert wrong != right
    (page.files / "wrong.js").write_text(wrong, encoding="utf-8")
    answer = page.run(JUDGED.replace("draw.js", "wrong.js"))
    assert answer["verdict"]["message"].startswith("outside: ")
    assert bundle.acceptance.drawn.sum() >= answer["verdict"]["outside"] > 20
