import base64
import dataclasses
import hashlib
import io
import json

import numpy as np
import pytest
from PIL import Image

from tests.report import cases
from tests.report.cases import HOSTILE
from tests.report.pages import Page
from volref import FormatError, check
from volref.report.judging import MOST_OF_AN_IMAGE, judging_page, write_judging
from volref.report.verdicts.cases import Case
from volref.report.verdicts.views import difference_of, difference_picture, interval_picture, scale_of, shown

KILOBYTE = 1000


@pytest.fixture(scope="module")
def every():
    return cases.every_kind()


@pytest.fixture(scope="module")
def html(every):
    return judging_page(every, title="A page")


@pytest.fixture(scope="module")
def page(html):
    return Page(html)


def pixels_of(attributes):
    head, _, data = attributes["src"].partition(",")
    assert head == "data:image/png;base64"
    with Image.open(io.BytesIO(base64.b64decode(data))) as image:
        return np.asarray(image)


def named(page, text):
    """Return the only picture whose words begin so."""
    (found,) = [a for a, _ in page.all("img") if a["alt"].startswith(text)]
    return found


def classes(page, name):
    return [(tag, a, "".join(text)) for tag, a, text in page.elements if name in a.get("class", "").split()]


def test_the_page_is_well_formed_and_has_one_title_and_one_heading(html, page):
    assert html.startswith("<!doctype html>")
    assert page.texts("title") == page.texts("h1") == ["A page"]
    assert page.all("html")[0][0]["lang"] == "en"


def test_headings_go_down_one_step_at_a_time(page):
    ranks = [int(tag[1]) for tag, _, _ in page.elements if tag in ("h1", "h2", "h3", "h4")]
    assert ranks[0] == 1
    assert max(np.diff(ranks)) == 1


def test_the_page_needs_nothing_from_elsewhere(page):
    for tag, attributes, _ in page.elements:
        assert tag not in ("link", "iframe", "object", "base")
        for name, value in attributes.items():
            assert not name.startswith("on")
            if name in ("src", "srcset", "action", "poster", "data", "background"):
                assert value.startswith("data:image/png;base64,")
            if name == "href":
                assert value.startswith("#case-")
    for text in page.texts("style") + page.texts("script"):
        assert all(word not in text for word in ("url(", "@import", "http:", "https:", "fetch("))


def test_only_the_pages_own_script_may_run(page):
    (policy,) = [a["content"] for a, _ in page.all("meta") if "http-equiv" in a]
    (script,) = [text for a, text in page.all("script") if a["type"] == "module"]
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert policy == (
        f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{digest}'"
    )
    others = {a["type"] for a, _ in page.all("script")} - {"module"}
    assert others == {"text/plain", "application/json"}


def test_text_of_strangers_stays_text():
    codes = cases.canvas()
    accepted = dataclasses.replace(
        cases.intervals(codes, advice=HOSTILE), causes={HOSTILE: np.full(codes.shape[:2], 0.01)}
    )
    verdict = check(codes.astype(np.uint8), accepted, cause=HOSTILE)
    why = cases.why(((HOSTILE, 1.0, 0.5),), HOSTILE, codes / 255, verdict)
    plain = cases.why((("fault", 1.0, 0.5),), "words", codes / 255, verdict)
    targets = {HOSTILE: codes / 255}
    bad = Case(HOSTILE, accepted, verdict, why, targets, {HOSTILE: HOSTILE})
    good = Case(
        "name",
        dataclasses.replace(accepted, causes={"cause": accepted.causes[HOSTILE]}),
        check(codes.astype(np.uint8), cases.intervals(codes, advice="advice"), cause="cause"),
        plain,
        {"canvas": codes / 255},
        {"hash": "abc"},
    )
    shapes = [
        [(tag, sorted(attributes)) for tag, attributes, _ in Page(judging_page([case], title=title)).elements]
        for case, title in ((bad, HOSTILE), (good, "Verdicts"))
    ]
    assert shapes[0] == shapes[1]


def test_the_pictures_are_the_images_pixel_for_pixel(page, every):
    case = every[1]
    acceptance = case.acceptance
    difference = difference_of(case.candidate, acceptance.nominal)
    expected = {
        "Candidate of wrong": shown(case.candidate),
        "Nominal of wrong": shown(acceptance.nominal),
        "Difference of wrong": difference_picture(difference, scale_of(difference)),
        "Interval of wrong": interval_picture(
            case.candidate, acceptance.lo, acceptance.hi, case.verdict.outside
        ),
        "Counterfactual for wrong": shown(case.counterfactual),
    }
    for words, codes in expected.items():
        np.testing.assert_array_equal(pixels_of(named(page, words)), codes)
    np.testing.assert_array_equal(shown(case.candidate), np.rint(255 * case.candidate[..., :3]))


def test_every_target_is_there_in_its_order(page):
    buttons = classes(page, "target")
    assert [text for _, _, text in buttons] == ["1back_coordinates", "2distance", "3canvas"]
    coordinates = pixels_of(named(page, "back_coordinates"))
    np.testing.assert_array_equal(coordinates, cases.canvas()[..., :3])


def test_every_picture_has_words_or_stands_beside_them(page):
    for attributes, _ in page.all("img"):
        assert int(attributes["width"]) > 0
        assert int(attributes["height"]) > 0
    silent = [a for a, _ in page.all("img") if not a["alt"]]
    assert len(silent) == len([text for a, text in page.all("a") if a["href"].startswith("#case-") and text])


def test_controls_have_names_and_groups(page):
    for text in page.texts("legend") + page.texts("button") + page.texts("label") + page.texts("summary"):
        assert text.strip()
    assert len(page.all("fieldset")) == len(page.texts("legend"))
    named_by_label = {a["for"] for a, _ in page.all("label") if "for" in a}
    for attributes, _ in page.all("input"):
        inside_a_label = attributes["type"] in ("radio", "search")
        assert inside_a_label or attributes["id"] in named_by_label
    stages = classes(page, "stage")
    assert len(stages) == len(page.all("details"))
    for _, attributes, _ in stages:
        assert attributes["tabindex"] == "0"
        assert "Arrow keys move by a pixel" in attributes["aria-label"]


def test_every_group_of_buttons_is_its_own_and_has_one_choice(page):
    groups = {}
    for attributes, _ in page.all("input"):
        if attributes["type"] == "radio":
            groups.setdefault(attributes["name"], []).append("checked" in attributes)
    assert all(sum(chosen) == 1 for chosen in groups.values())
    assert len(groups) == len(page.all("fieldset"))


def test_every_label_names_something_that_is_there_once(page):
    ids = [attributes["id"] for _, attributes, _ in page.elements if "id" in attributes]
    assert len(ids) == len(set(ids))
    assert {a["href"].removeprefix("#") for a, _ in page.all("a")} <= set(ids)


def test_what_scrolls_can_be_reached_by_keyboard(page):
    assert all("tabindex" in attributes for _, attributes, _ in classes(page, "scroll"))


def test_what_failed_comes_first_and_is_open(page):
    kinds = [a["data-kind"] for a, _ in page.all("details")]
    assert kinds == ["fail"] * 3 + ["open", "warn", "pass", "pass"]
    assert [("open" in a) for a, _ in page.all("details")] == [kind != "pass" for kind in kinds]
    assert [a["data-kind"] for a, _ in page.all("li") if "data-kind" in a] == kinds


def test_the_counts_are_those_of_the_verdicts(page):
    counts = dict(zip(page.texts("dt"), page.texts("dd"), strict=True))
    assert counts == {
        "outside": "3",
        "not comparable": "1",
        "inside with low-quality filtering": "1",
        "inside": "2",
    }
    (head,) = [text for _, _, text in classes(page, "headline")]
    assert head == (
        "7 images held against what a correct machine may draw: 3 outside, 1 not comparable, "
        "1 inside with low-quality filtering, 2 inside."
    )


def test_an_unjustified_verdict_says_so_wherever_its_badge_stands(page):
    assert len(classes(page, "chosen")) == 2
    assert {text for _, _, text in classes(page, "chosen")} == {"unjustified"}


def test_the_verdict_the_reason_and_the_provenance_are_told(page, every):
    paragraphs = page.texts("p")
    for case in every:
        assert case.verdict.message in paragraphs
    assert every[1].explanation.message in paragraphs
    rows = [text for a, text in page.all("tr")]
    assert any(text.startswith("O1-uncorrectedopacity is not corrected") and "90%" in text for text in rows)
    assert any("steps have another length" in text and "1.05, 1" in text for text in rows)
    assert not any(text.startswith("A1-row-divisor") for text in rows)
    assert "1 other fault tried: less than these, or nothing." in paragraphs
    assert "sha256 of the scene3b1f" in rows
    assert any(text.startswith("NumPy") and np.__version__ in text for text in rows)
    assert any(text.startswith("filter weights") for text in rows)
    assert not any(text.startswith("branches") for text in rows)


def test_a_page_of_one_image_has_nothing_to_filter_and_one_of_none_says_so(every):
    assert not classes(Page(judging_page([every[0]])), "filter")
    assert "No image was judged." in Page(judging_page([])).texts("p")
    (head,) = [text for _, _, text in classes(Page(judging_page([every[0]])), "headline")]
    assert head.startswith("1 image held against")


def test_an_explanation_may_name_nothing(every):
    said = "None of the known faults explains this."
    none = cases.why((), said, None, every[1].verdict, "none of these")
    page = Page(judging_page([dataclasses.replace(every[1], explanation=none)]))
    assert said in page.texts("p")
    assert "counterfactual" not in [a.get("value") for a, _ in page.all("input")]
    assert [text for _, _, text in classes(page, "cause")] == ["no known fault"]


def test_faults_that_draw_the_same_here_are_not_told_apart(every):
    found = dataclasses.replace(every[1].explanation, status="not identifiable here")
    page = Page(judging_page([dataclasses.replace(every[1], explanation=found)]))
    (cause,) = [text for _, _, text in classes(page, "cause")]
    assert cause == "O1-uncorrected explains 90%, or others that look alike"


def test_an_image_inside_needs_no_explanation(every):
    clean = cases.why((), every[0].verdict.message, None, every[0].verdict, "none")
    page = Page(judging_page([dataclasses.replace(every[0], explanation=clean)]))
    assert "Why" not in page.texts("h4")


def test_a_long_ranking_is_cut_and_said_to_be(every):
    long = tuple((f"fault {k}", 1.0, 0.9 - 0.05 * k) for k in range(11))
    found = cases.why(long, "m", None, every[1].verdict)
    page = Page(judging_page([dataclasses.replace(every[1], explanation=found)]))
    assert "3 other faults tried: less than these, or nothing." in page.texts("p")


def test_a_case_of_64_by_64_pixels_takes_less_than_150_kilobytes():
    empty = len(judging_page([]))
    for make in (cases.failing, cases.floating):
        case = make(size=(64, 64))
        targets = {f"target {k}": np.roll(case.candidate, k, axis=0) for k in range(3)}
        full = dataclasses.replace(case, passes={k: np.nan_to_num(v, posinf=1.0) for k, v in targets.items()})
        assert len(judging_page([full])) - empty < 150 * KILOBYTE


def test_large_images_are_reduced_and_said_to_be():
    case = cases.failing(size=(250, 270))
    text = judging_page([case])
    page = Page(text)
    (viewer,) = [a for _, a, _ in classes(page, "viewer")]
    assert (viewer["data-width"], viewer["data-height"], viewer["data-factor"]) == ("135", "125", "2")
    assert int(viewer["data-width"]) * int(viewer["data-height"]) <= MOST_OF_AN_IMAGE
    assert any("Reduced 2 : 1" in words for words in page.texts("p"))
    assert len(text) < 600 * KILOBYTE


def test_many_images_share_the_room_of_a_page(monkeypatch):
    from volref.report import judging

    monkeypatch.setattr(judging, "MOST_OF_A_PAGE", 1000)
    page = Page(judging_page([cases.passing(str(k)) for k in range(10)]))
    for _, viewer, _ in classes(page, "viewer"):
        assert int(viewer["data-width"]) * int(viewer["data-height"]) <= 100


def test_the_scripts_data_is_what_it_says(page):
    (palette,) = [text for a, text in page.all("script") if a["type"] == "application/json"]
    assert set(json.loads(palette)) >= {"viridis", "signed", "scales"}


def test_the_page_is_written_once(tmp_path, every):
    write_judging(tmp_path / "page.html", every[:1])
    assert (tmp_path / "page.html").read_text(encoding="utf-8") == judging_page(every[:1])
    with pytest.raises(FormatError, match="must not exist yet"):
        write_judging(tmp_path / "page.html", every)
    write_judging(tmp_path / "page.html", every[1:2], overwrite=True, title="Other")
    assert "<h1>Other</h1>" in (tmp_path / "page.html").read_text(encoding="utf-8")
