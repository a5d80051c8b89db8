"""The part of a case in which images are laid side by side, over each other and apart, pixel by pixel.

What needs the page's script is hidden until it runs; without it there are four still pictures.
"""

from html import escape

from volref.report.markup import inline_image, legend, scrolling
from volref.report.pictures import LEVEL, error_map
from volref.report.verdicts.cases import Case
from volref.report.verdicts.pixels import Sample, packed
from volref.report.verdicts.views import (
    SCALES,
    difference_of,
    difference_picture,
    interval_picture,
    scale_of,
    shown,
)
from volref.report.verdicts.words import outside_words

VIEWS = {
    "side": "Side by side",
    "flicker": "Flicker",
    "wipe": "Wipe",
    "difference": "Difference",
    "interval": "Interval",
    "width": "Width",
    "ambiguous": "Ambiguous",
}
CHANNELS = {"all": "All", "0": "Red", "1": "Green", "2": "Blue", "3": "Alpha"}
CHANNELS_IN_FULL = ("red", "green", "blue", "alpha")
SIGNS = {"signed": "Signed", "absolute": "Absolute"}
BACKDROPS = {"black": "Black", "white": "White", "checks": "Checks"}

KEYS = (
    "Arrow keys move by a pixel, with Shift by eight; W goes to the worst pixel, N to the next one outside; "
    "Space changes the image while flickering."
)


def stills(case: Case, sample: Sample) -> str:
    """Return candidate, nominal, difference and interval as figures."""
    acceptance = case.acceptance
    candidate, nominal = sample(case.candidate), sample(acceptance.nominal)
    difference = difference_of(candidate, nominal)
    scale = scale_of(difference)
    pictures = [
        ("Candidate", shown(candidate), "what was judged"),
        ("Nominal", shown(nominal), "what the emulation draws"),
        (
            "Difference",
            difference_picture(difference, scale),
            f"candidate less nominal, from -{scale}/255 (blue) over 0 (black) to {scale}/255 (orange)",
        ),
        (
            "Interval",
            interval_picture(
                candidate, sample(acceptance.lo), sample(acceptance.hi), sample(case.verdict.outside)
            ),
            "blue: below the interval; orange: above; pink: both; the brighter the further out",
        ),
    ]
    figures = "".join(
        f"<figure>{inline_image(codes, f'{name} of {case.name}: {about}', *codes.shape[1::-1])}"
        f"<figcaption><strong>{name}</strong> {escape(about)}</figcaption></figure>"
        for name, codes, about in pictures
    )
    return f'<div class="stills">{figures}</div>'


def viewer(case: Case, number: int, sample: Sample) -> str:
    """Return the controls, the stage, the legends and the readout of a case."""
    about, numbers = packed(case, sample)
    more = {"worst": _worst(case, sample), "alpha": "judged" if case.judges_alpha else "ignored"}
    data = "".join(f' data-{key}="{escape(value)}"' for key, value in (about | more).items())
    return (
        f'<div class="viewer" hidden{data}>'
        f"{_controls(case, number)}"
        f'<div class="bench"><div>{_stage(case, number)}{_below(case, sample, number)}</div>'
        f"{_readout(case)}</div>"
        f'<script type="text/plain" class="numbers">{numbers}</script></div>'
    )


def _worst(case: Case, sample: Sample) -> str:
    """Return the place, in what is shown, of the pixel that is most outside; the middle if none is."""
    excess = sample(case.verdict.excess)
    height, width = excess.shape
    far = int(excess.argmax()) if excess.any() else height // 2 * width + width // 2
    return f"{far % width} {far // width}"


def _controls(case: Case, number: int) -> str:
    against = {"nominal": "Nominal"}
    if case.counterfactual is not None:
        against["counterfactual"] = "Counterfactual"
    others = [
        choice("Compare with", "against", number, against) if len(against) > 1 else "",
        choice("Channel", "channel", number, CHANNELS),
        choice("Backdrop", "backdrop", number, BACKDROPS),
        choice("Difference", "sign", number, SIGNS),
        choice("Ends of the scale, 1/255", "scale", number, _scales()),
    ]
    return (
        f'<div class="controls">{choice("View", "view", number, VIEWS)}'
        f'<div class="settings">{"".join(others)}</div></div>'
    )


def _scales() -> dict[str, str]:
    return {str(scale): f"±{scale}" for scale in SCALES}


def choice(title: str, name: str, number: int, options: dict[str, str]) -> str:
    """Return radio buttons in a row; the first one is chosen."""
    buttons = "".join(
        f'<label><input type="radio" name="{name}-{number}" value="{value}"{" checked" * (not k)}>'
        f"<span>{escape(word)}</span></label>"
        for k, (value, word) in enumerate(options.items())
    )
    return (
        f'<fieldset class="choice" data-setting="{name}"><legend>{escape(title)}</legend>'
        f"<div>{buttons}</div></fieldset>"
    )


def _stage(case: Case, number: int) -> str:
    label = escape(f"Pixels of {case.name}. {KEYS}")
    panes = "".join(
        '<div class="pane"><p class="name"></p><div class="sheet"><canvas></canvas>'
        '<div class="cross"></div><div class="edge"></div></div></div>'
        for _ in range(2)
    )
    return (
        f'<div class="stage" id="stage-{number}" role="application" tabindex="0" '
        f'aria-roledescription="pixel inspector" aria-label="{label}">{panes}</div>'
    )


def _below(case: Case, sample: Sample, number: int) -> str:
    """Return what belongs to one view each: buttons, slider, legends."""
    widths = error_map(case.acceptance.width)
    reduced = (
        f'<p class="note">Reduced {sample.factor} : 1. Of every {sample.factor} x {sample.factor} pixels the '
        "worst one is shown, with its own numbers and place.</p>"
    )
    return (
        '<div class="extra" data-view="flicker"><button type="button" class="swap">Show the other</button>'
        '<button type="button" class="play" aria-pressed="false">Every half second</button></div>'
        f'<div class="extra" data-view="wipe"><label for="wipe-{number}">Border</label>'
        f'<input type="range" class="border" id="wipe-{number}" min="0" max="100" value="50"></div>'
        '<div class="extra legend" data-view="difference"><div class="ramp"></div><div class="ticks"></div>'
        '<p class="key"></p></div>'
        '<div class="extra legend" data-view="interval">'
        '<p class="key"><span class="chip below"></span> below the interval</p>'
        '<p class="key"><span class="chip above"></span> above it</p>'
        '<p class="key"><span class="chip both"></span> below in one channel, above in another</p>'
        '<p class="key"><span class="chip inside"></span> inside, as a dark grey image</p>'
        '<p class="key">The brighter, the further out: full at 31/255.</p>'
        f'<p class="key">{outside_words(case).capitalize()}.</p></div>'
        f'<div class="extra legend" data-view="width" data-top="{_top(case)}">{legend(widths)}'
        '<p class="key">How wide the interval of a pixel is before the canvas rounds, '
        "its widest channel.</p></div>"
        '<div class="extra legend" data-view="ambiguous">'
        '<p class="key"><span class="chip ambiguous"></span> hangs on a comparison: correct machines '
        "may differ by a whole sample</p>"
        '<p class="key"><span class="chip plain"></span> drawn, and does not</p>'
        '<p class="key"><span class="chip nothing"></span> nothing is drawn here</p></div>'
        f"{reduced if sample.factor > 1 else ''}"
    )


def _top(case: Case) -> str:
    """Return the power of ten, in 1/255, at which the scale of widths ends."""
    widest = float(case.acceptance.width.max(initial=0.0)) / LEVEL
    return error_map(case.acceptance.width).ticks[-1][1] if widest > 0 else "1"


def _readout(case: Case) -> str:
    fields = {"candidate": "candidate", "lo": "lowest", "nominal": "nominal", "hi": "highest"}
    lines = {f'data-field="{name}"': word for name, word in fields.items()}
    lines['class="beyond"'] = "outside by"
    if case.counterfactual is not None:
        lines['data-field="counterfactual"'] = "with fault"
    head = "".join(f'<th scope="col">{name}</th>' for name in ("1/255", *CHANNELS_IN_FULL))
    rows = "".join(
        f'<tr {mark}><th scope="row">{word}</th>{"<td></td>" * len(CHANNELS_IN_FULL)}</tr>'
        for mark, word in lines.items()
    )
    table = f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"
    none = "" if case.verdict.outside.any() else " disabled"
    glasses = '<div class="sheet glass-frame"><canvas class="glass"></canvas></div>' * 2
    return (
        '<div class="readout"><p class="place" role="status"></p>'
        f"{scrolling('Numbers of the pixel', table)}"
        f'<div class="near"><div class="glasses" aria-hidden="true">{glasses}</div>'
        f'<div class="moves"><button type="button" class="worst"{none}>Worst pixel</button>'
        f'<button type="button" class="next"{none}>Next outside</button></div></div>'
        f'<p class="key keys">Point at a pixel, or focus the image. {escape(KEYS)}</p></div>'
    )
