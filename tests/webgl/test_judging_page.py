"""The page of verdicts as a reader has it: by keyboard, on a phone, in the dark, from a file."""

import base64
import io

import numpy as np
import pytest
from PIL import Image

from tests.report import cases
from volref.report.judging import write_judging
from volref.report.pictures import error_map
from volref.report.verdicts.views import difference_of, difference_picture, interval_picture, scale_of, shown

DESKTOP = {"width": 1280, "height": 900}
PHONE = {"width": 390, "height": 844}


@pytest.fixture(scope="module")
def every():
    return cases.every_kind()


@pytest.fixture(scope="module")
def path(every, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "verdicts.html"
    write_judging(path, every)
    return path


def opened(page, name):
    """Return the part of the page about a case, open and with its viewer at work."""
    part = page.locator("details.case", has=page.locator("h3", has_text=name)).first
    part.evaluate("part => { part.open = true; part.scrollIntoView(); }")
    part.locator(".readout .place:has-text('x ')").wait_for()
    return part


def chosen(part, setting, word):
    part.locator(f"fieldset[data-setting={setting}] label", has_text=word).first.click()


def painted(part, which=0):
    address = part.locator(".stage canvas").nth(which).evaluate("canvas => canvas.toDataURL()")
    with Image.open(io.BytesIO(base64.b64decode(address.partition(",")[2]))) as image:
        return np.asarray(image)[..., :3]


def said(part, name):
    """Wait until the first image is the one of that name."""
    part.locator(f".pane:first-child .name:text-is('{name}')").wait_for()


def place(part):
    words = part.locator(".place").inner_text()
    x, y = words.split(":")[0].removeprefix("x ").split(", y ")
    return int(x), int(y)


def numbers(part, name):
    return part.locator(f"tr[data-field={name}] td").all_inner_texts()


@pytest.mark.parametrize(("viewport", "scheme"), [(DESKTOP, "light"), (DESKTOP, "dark"), (PHONE, "light")])
def test_every_case_and_view_shows_without_a_word_on_the_console_and_nothing_is_wider_than_the_screen(
    visit, path, every, viewport, scheme
):
    def look(page):
        for case in every:
            part = opened(page, case.name)
            assert page.evaluate("document.documentElement.scrollWidth - innerWidth") <= 0
        for view in part.locator("fieldset[data-setting=view] label").all():
            view.click()
            assert page.evaluate("document.documentElement.scrollWidth - innerWidth") <= 0
        return page.evaluate("getComputedStyle(document.body).backgroundColor")

    color = visit(path, look, viewport=viewport, color_scheme=scheme, reduced_motion="reduce")
    assert color == ("rgb(255, 255, 255)" if scheme == "light" else "rgb(19, 20, 23)")


def test_the_script_paints_what_python_paints(visit, path, every):
    case = every[1]
    acceptance = case.acceptance
    difference = difference_of(case.candidate, acceptance.nominal)
    expected = {
        "Side by side": shown(case.candidate),
        "Difference": difference_picture(difference, scale_of(difference)),
        "Interval": interval_picture(case.candidate, acceptance.lo, acceptance.hi, case.verdict.outside),
        "Width": error_map(acceptance.width).colors,
    }

    def look(page):
        part = opened(page, case.name)
        found = {}
        for view in expected:
            chosen(part, "view", view)
            found[view] = painted(part)
        chosen(part, "view", "Side by side")
        return found, painted(part, 1)

    found, nominal = visit(path, look, viewport=DESKTOP)
    for view, colors in expected.items():
        # A colour between two of a scale, in other orders of the same products: halves may round either way;
        # a step of the packed width is 1/8000 decade, that is .01 of 255.
        assert np.abs(found[view].astype(int) - colors).max() <= 1, view
    np.testing.assert_array_equal(found["Side by side"], expected["Side by side"])
    np.testing.assert_array_equal(nominal, shown(acceptance.nominal))


def test_arrow_keys_move_the_inspector_and_it_tells_the_numbers_of_the_images(visit, path, every):
    case = every[1]
    codes = {
        "candidate": case.candidate,
        "lo": case.acceptance.lo,
        "nominal": case.acceptance.nominal,
        "hi": case.acceptance.hi,
        "counterfactual": case.counterfactual,
    }

    def look(page):
        part = opened(page, case.name)
        found = [(place(part), part.locator(".beyond td").all_inner_texts())]
        part.locator(".stage").focus()
        for key in ("ArrowLeft", "ArrowUp", "Shift+ArrowRight", "ArrowDown", "n", "N", "Shift+ArrowUp", "w"):
            page.keyboard.press(key)
            found.append((place(part), {name: numbers(part, name) for name in codes}))
        return found

    (start, beyond), *moved = visit(path, look, viewport=DESKTOP)
    height, width = case.verdict.outside.shape
    worst = np.unravel_index(case.verdict.excess.argmax(), (height, width))
    assert start == (worst[1], worst[0])
    over = np.rint(255 * (case.candidate - case.acceptance.hi))[worst]
    assert beyond == [f"+{number:.0f}" if number > 0 else "inside" for number in over]
    x, y = start
    steps = [(x - 1, y), (x - 1, y - 1), (x + 7, y - 1), (x + 7, y)]
    assert [at for at, _ in moved[:4]] == steps
    out = np.flatnonzero(case.verdict.outside)
    first = out[np.searchsorted(out, (y * width + x + 7) + 1)]
    assert [moved[4][0], moved[5][0]] == [
        (i % width, i // width) for i in (first, out[np.searchsorted(out, first + 1)])
    ]
    assert moved[6][0][1] == max(moved[5][0][1] - 8, 0)
    assert moved[7][0] == start
    for (column, row), told in moved:
        for name, image in codes.items():
            assert told[name] == [f"{number:.0f}" for number in 255 * image[row, column]]


def test_a_click_shows_the_pixel_under_it(visit, path, every):
    def look(page):
        part = opened(page, every[1].name)
        box = part.locator(".stage canvas").first.bounding_box()
        height, width = every[1].verdict.outside.shape
        page.mouse.click(box["x"] + 3.5 * box["width"] / width, box["y"] + 7.5 * box["height"] / height)
        return place(part)

    assert visit(path, look, viewport=DESKTOP) == (3, 7)


def test_flicker_stands_still_for_who_wants_that_and_space_changes_the_image(visit, path, every):
    case = every[1]

    def look(page):
        part = opened(page, case.name)
        part.locator("input[value=side]").focus()
        page.keyboard.press("ArrowRight")
        name = part.locator(".pane .name").first
        still = part.locator(".play").get_attribute("aria-pressed")
        words, pictures = [name.inner_text()], [painted(part)]
        part.locator(".stage").focus()
        for _ in range(2):
            page.keyboard.press("Space")
            words.append(name.inner_text())
            pictures.append(painted(part))
        part.locator(".play").press("Enter")
        said(part, "nominal")
        said(part, "candidate")
        return still, words, pictures

    still, words, pictures = visit(path, look, viewport=DESKTOP, reduced_motion="reduce")
    assert still == "false"
    assert words == ["candidate", "nominal", "candidate"]
    np.testing.assert_array_equal(pictures[0], shown(case.candidate))
    np.testing.assert_array_equal(pictures[1], shown(case.acceptance.nominal))


def test_flicker_begins_by_itself_for_who_does_not_mind(visit, path, every):
    def look(page):
        part = opened(page, every[1].name)
        chosen(part, "view", "Flicker")
        assert part.locator(".play").get_attribute("aria-pressed") == "true"
        said(part, "nominal")
        part.locator(".play").click()
        return part.locator(".play").get_attribute("aria-pressed")

    assert visit(path, look, viewport=DESKTOP, reduced_motion="no-preference") == "false"


def test_the_wipe_shows_the_candidate_left_of_its_border(visit, path, every):
    case = every[1]

    def look(page):
        part = opened(page, case.name)
        chosen(part, "view", "Wipe")
        part.locator(".border").focus()
        for _ in range(25):
            page.keyboard.press("ArrowLeft")
        return painted(part)

    both = visit(path, look, viewport=DESKTOP)
    columns = round(0.25 * both.shape[1])
    np.testing.assert_array_equal(both[:, :columns], shown(case.candidate)[:, :columns])
    np.testing.assert_array_equal(both[:, columns:], shown(case.acceptance.nominal)[:, columns:])


def test_a_scale_and_a_channel_can_be_chosen_and_the_legend_follows(visit, path, every):
    case = every[1]
    green = difference_of(case.candidate[..., 1:2], case.acceptance.nominal[..., 1:2])

    def look(page):
        part = opened(page, case.name)
        chosen(part, "view", "Difference")
        chosen(part, "channel", "Green")
        chosen(part, "scale", "±16")
        ticks = part.locator(".legend[data-view=difference] .ticks span").all_inner_texts()
        picture = painted(part)
        chosen(part, "sign", "Absolute")
        return ticks, picture, part.locator(".legend[data-view=difference] .ticks span").all_inner_texts()

    signed, picture, absolute = visit(path, look, viewport=DESKTOP)
    assert signed == ["-16", "-8", "0", "+8", "+16"]
    assert absolute == ["0", "8", "16"]
    # halves may round either way
    assert np.abs(picture.astype(int) - difference_picture(green, 16)).max() <= 1


def test_the_list_is_filtered_by_kind_and_by_name_and_leads_to_the_case(visit, path):
    def look(page):
        def listed():
            return page.locator(".lines li:visible .title").all_inner_texts()

        every = listed()
        page.locator(".filter label", has_text="Fail").click()
        failed = listed()
        page.locator(".filter [type=search]").fill("ALPHA")
        named = listed()
        page.locator(".lines li:visible a").press("Enter")
        hidden = page.locator("details.case:visible h3").all_inner_texts()
        page.locator(".filter [type=search]").fill("")
        page.locator(".filter label", has_text="All").click()
        page.locator(".lines li:visible a", has_text="right").press("Enter")
        opened_now = page.locator("details.case[open] h3", has_text="right").count()
        return every, failed, named, hidden, opened_now

    every, failed, named, hidden, opened_now = visit(path, look, viewport=DESKTOP)
    assert len(every) == 7
    assert failed == ["wrong", "float canvas", "without alpha"]
    assert named == hidden == ["without alpha"]
    assert opened_now == 1


def test_a_target_is_enlarged_by_keyboard_and_closed_again(visit, path, every):
    def look(page):
        part = opened(page, every[1].name)
        button = part.locator(".target").nth(1)
        button.press("Enter")
        page.locator("dialog[open]").wait_for()
        caption = page.locator("dialog figcaption").inner_text()
        page.keyboard.press("Escape")
        page.locator("dialog[open]").wait_for(state="detached")
        return caption, button.evaluate("button => button === document.activeElement")

    caption, back = visit(path, look, viewport=DESKTOP)
    assert caption == "distance, 24 x 20, 1 channels"
    assert back


def test_numbers_that_are_none_are_said(visit, path):
    def look(page):
        part = opened(page, "float canvas")
        first = (place(part), numbers(part, "candidate"))
        part.locator(".next").click()
        return first, (place(part), numbers(part, "candidate"), part.locator(".beyond td").all_inner_texts())

    first, second = visit(path, look, viewport=DESKTOP)
    assert first[0] == (9, 8)
    assert first[1][1] == "NaN"
    assert second[0] == (9, 9)
    assert second[1][2] == "inf"
    assert second[2][2] == "+inf"


def test_a_name_from_a_stranger_runs_nothing(visit, tmp_path):
    write_judging(tmp_path / "page.html", [cases.passing(cases.HOSTILE), cases.failing(cases.HOSTILE)])

    def look(page):
        part = opened(page, "onerror")
        return page.evaluate("window.hacked"), part.locator("h3").inner_text()

    hacked, name = visit(tmp_path / "page.html", look, viewport=DESKTOP)
    assert hacked is None
    assert name == cases.HOSTILE


def test_without_scripts_there_are_still_pictures(visit, path):
    def look(page):
        return [page.locator(what).first.is_visible() for what in (".stills img", ".viewer", ".filter")]

    assert visit(path, look, viewport=PHONE, java_script_enabled=False) == [True, False, False]
