"""What the page says between its numbers."""

import textwrap

WIDTH = 110

HEAD = """
A project that draws volumes keeps golden images, and a rule for how far a new one may be from them: so
many pixels may differ by so much. What do such rules catch, and what do they wrongly fail? Here the
rules of {criteria} projects, and volref's intervals, are held against {faulty} images with a fault that
shows and {correct} correct ones. Two commands draw this page again:
"""

COMMANDS = """
    $ npm install --prefix data_gen/why_intervals
    $ python -m data_gen.why_intervals{webgl}
"""

RESULT = """
Rules that fail no correct image here catch {most} of the faults at most; no threshold of any of their
measures would catch more than {hindsight} and still fail none. Rules that catch all faults fail {least}
correct images at least. With the machine named, volref catches {known} and fails {known_failed}.

For a set of machines there is a third verdict, a warning: *inside only with low-quality filtering*, by
filters of 4 bits, which WebGL allows. {warned} images with a fault and {warned_right} correct ones get
it; they count as passed above, as do {open_right} correct ones that are *not comparable*, where `accept`
says what has to be known about the machine.
"""

FIGURE = """\
![Which criterion catches which fault](images/why-intervals.png)

Faults that show, by criterion: yellow where it is caught in all scenes, dark where it is missed in all.
"""

METHOD = """
- **Scenes**: {scenes}, of {pixels} x {pixels} pixels at most, over an opaque background, so that a
picture is its red, green and blue. They are listed below.

- **Golden**: what a project would keep; here each scene drawn in ideal arithmetic, in 8 bits.

- **Faults**: {faults} of the [table of faults](faults.md), bugs that real renderers have had, each at one
strength, such as half a voxel. They are drawn as `swiftshader` would, the software implementation that
headless Chromium comes with. A fault *shows* where it moves a byte of the same machine's picture by
{visible} or more; {hidden} more images have one that does not. A rule has *caught* a fault where it
rejects the image, also where it would have rejected the machine without it.

- **Correct images**: the same scenes without a fault, on {machines}. These machines are emulated, which
[is held to real WebGL](webgl.md){real}. *8-bit weights* is what graphics cards do.

- **volref** judges by `check(image, accept(scene, pipeline, device))`: with the machine that drew the
image named, and in a row of its own by one set of machines, `webgl-highp`, whoever drew it.

Rules are given 8-bit pictures and run in the projects' own packages where there are any; a rule of a
line or two is written again. Screenshots of real projects go through more, such as JPEG or being halved
in size, which hides more.
"""

OFF_BY = """
*Off by* is the largest difference that the fault makes to the same machine's picture, in 1/255, in the
scene where it is least and in the one where it is most.
"""

UNSEEN = """
{unseen} images have a fault that moves no byte by more than 1/255: an opacity that never reaches the
threshold, a mirror image of what is symmetric. They are in no count above. {equal} of them are equal,
byte for byte, to what the same machine draws without the fault, so that to reject them is to reject the
machine: {crying}. Of the {ones} that are off by 1/255, volref rejects {known}, with the machine named:
there its interval is one code wide.
"""

HINDSIGHT = """
For each measure, the strictest threshold that fails no correct image here, found with hindsight: no
project could have known it.
"""

BY_SCENE = """
The same by `webgl-highp`, with the width that 99 % of its intervals do not exceed. Scenes where it rejects
the machine that draws the faults, and so catches all of them: {alien}.
"""

WIDTHS = """
How wide the intervals are before the canvas rounds, in 1/255: of half of the pixels at most p50, of 99 %
at most p99; and how many of 100 pixels hang on a comparison. Each from the scene where it is least to
the one where it is most.
"""

LIMITS = """
- An interval needs the scene and the program: `accept` follows every ray. The other rules need two
pictures. Where a program cannot be described to volref, this page says nothing about it.

- The faulty images are drawn by the emulator that the intervals come from. That an interval holds for
other people's arithmetic is shown on [real WebGL](webgl.md); faults in real shaders are judged in the
tests.

- An interval is for one machine, or for a set that was described. Where the machine is not in the set,
correct images are rejected: above, {any_failed} of {correct} by `webgl-highp`. Name the device, or let
`probe` find it.

- Where a fault moves a number by less than correct machines differ, it passes, as it must. Where a pixel
hangs on a comparison, such as whether a ray takes one more sample, its interval may be a whole sample
wide.

- A gradient next to 0 has no direction, and lights make of it what they like: in the lit scenes
intervals are wide, and a set of machines is judged by little else.

- If the machine never changes, equal bytes are the best rule of all, and the cheapest: they catch
whatever shows. They fail {unequal} of the {correct} correct images here, all at once as soon as
something below the program is updated.

- Those who chose the faults also wrote the intervals. Some faults are coarse: a picture upside down.
"""

SOURCES = """
Projects set other thresholds for single tests; these are their defaults, or what their comments
recommend (wgpu: from 0.01 on). In the file read of ANARI's, the answer for PSNR is stored in the place
of that for SSIM; here both must hold. SSIM, PSNR, FLIP, RMS, pixelmatch and VTK's error are computed by
the packages themselves; dEQP's comparison is written again after its source, with its random numbers.
"""


def filled(text: str, **values: object) -> str:
    """Return paragraphs of prose, each a line or a few, items with their second line set in."""
    paragraphs = text.format(**values).strip().split("\n\n")
    return (
        "\n"
        + "\n\n".join(
            textwrap.fill(
                " ".join(paragraph.split()),
                WIDTH,
                subsequent_indent="  " if paragraph.startswith("- ") else "",
                break_long_words=False,
                break_on_hyphens=False,
            )
            for paragraph in paragraphs
        ).replace("\n\n- ", "\n- ")
        + "\n"
    )


def lines(*lines: str) -> str:
    """Return lines as a block of their own."""
    return "\n" + "\n".join(lines) + "\n"
