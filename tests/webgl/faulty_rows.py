"""The faults that are drawn by real WebGL, each on a chart, by realistic strengths."""

from dataclasses import dataclass

from volref.golden.charts import CHARTS, Chart


@dataclass(frozen=True)
class Faulty:
    """A fault in a program.

    key: what it is called in `volref.oracle.faults`.  chart: where it is drawn.  way: what the GLSL or the
    page calls it, where there is more than one way to have the fault.
    """

    key: str
    strength: float
    chart: str
    way: str = ""

    def __str__(self) -> str:
        return f"{self.drawn_as} {self.strength:g} on {self.chart}"

    @property
    def drawn_as(self) -> str:
        return self.way or self.key

    def on(self) -> Chart:
        return CHARTS[self.chart]


FAULTY = (
    Faulty("A1-row-divisor", 1, "f-atlas"),
    Faulty("A1-printed-row", 1, "f-atlas"),
    Faulty("A1-second-column", 1, "f-atlas"),
    Faulty("A2-slice-off-by-one", 1, "f-atlas"),
    Faulty("A2-slice-off-by-one", 1, "values-as-opacity"),
    Faulty("A2-last-tile", 1, "ramp-by-bright"),
    Faulty("A2-last-tile", 1, "values-as-opacity"),
    Faulty("A3-half-slice", 0.5, "ramp-by-bright"),
    Faulty("A3-slice-count", 1, "ramp-by-bright"),
    Faulty("A3-no-interpolation", 1, "ramp-by-bright"),
    Faulty("A3-no-interpolation", 1, "values-as-opacity"),
    Faulty("A3-bleeding", 1, "clamped-tiles"),
    Faulty("A3-mix-by-x", 1, "f-atlas"),
    Faulty("G1-half-voxel", 0.5, "f-shape"),
    Faulty("G1-half-voxel", -0.5, "f-shape"),
    Faulty("G1-moved-box", 0.5, "f-shape"),
    Faulty("G2-node-centred", 1, "f-shape"),
    Faulty("G2-node-box", 1, "f-shape"),
    Faulty("G3-step-in-texture-space", 1, "long-voxels-y"),
    Faulty("G4-flip-x", 1, "f-shape"),
    Faulty("G4-flip-y", 1, "f-shape"),
    Faulty("G4-flip-z", 1, "f-shape"),
    Faulty("G4-swapped-axes", 1, "f-shape"),
    Faulty("G5-transform-ignored", 1, "turned"),
    Faulty("G5-vanishes-inside", 1, "inside"),
    Faulty("G6-brick-seams", 4, "f-shape"),
    Faulty("O1-uncorrected", 1, "grey-slab"),
    Faulty("O1-stale", 1.5, "grey-slab"),
    Faulty("O2-add-alpha", 1, "bright-back"),
    Faulty("O2-add-alpha", 1, "f-atlas"),
    Faulty("O2-add-alpha", 1, "values-as-opacity"),
    Faulty("O3-factor-per-sample", 0.8, "grey-slab"),
    Faulty("O4-ray-length", 1, "grey-slab"),
    Faulty("O5-straight-as-premultiplied", 1, "on-a-background"),
    Faulty("O5-straight-output", 1, "on-a-background"),
    Faulty("O5-premultiplied-twice", 1, "on-a-background"),
    Faulty("T1-early-stop", 0.9, "bright-back"),
    Faulty("T1-never-reached", 1, "bright-on-grey"),
    Faulty("T1-not-renormalised", 0.9, "bright-back"),
    Faulty("T2-first-step-dropped", 1, "opaque-border"),
    Faulty("T2-last-step-dropped", 1, "grey-slab"),
    Faulty("T2-last-step-whole", 1, "grey-slab"),
    Faulty("T2-last-step-doubled", 1, "grey-slab"),
    Faulty("T3-loop-cap", 0.5, "long-rays"),
    Faulty("T3-one-sided-exit", 1, "long-rays"),
    Faulty("T4-step", 1.1, "thin-slab"),
    Faulty("T4-step", 2, "thin-slab"),
    Faulty("J1-biased-jitter", 0, "thin-slab"),
    Faulty("J1-biased-jitter", 0.25, "lit-turned"),
    Faulty("J1-wood-grain", 1, "lit-turned"),
    Faulty("L1-half-texel", 0.5, "two-entries"),
    Faulty("L1-ends-for-centers", 1, "two-entries"),
    Faulty("L2-short-table", 64, "spike"),
    Faulty("L2-quantised-table", 4, "spike"),
    Faulty("L3-pre-classified", 1, "spike"),
    Faulty("L3-per-slice", 1, "ramp-by-bright"),
    Faulty("L3-post-classified", 1, "values-as-opacity"),
    Faulty("F1-nearest", 1, "checkers"),
    Faulty("F2-half-float", 1, "fine-values"),
    Faulty("F2-eight-bit", 1, "fine-values"),
    Faulty("F3-srgb-upload", 1, "f-shape"),
    Faulty("F3-premultiplied-upload", 1, "f-shape"),
    Faulty("F4-no-data", 1, "no-data"),
    Faulty("D1-view-depth", 1, "stripes-behind"),
    Faulty("D1-window-depth", 1, "wide-sphere"),
    Faulty("D1-window-depth", 1, "stripes-behind"),
    Faulty("D1-window-depth", 1, "sheet-through"),
    Faulty("D1-window-over-w", 1, "wide-sphere"),
    Faulty("D1-range", 1.1, "wide-sphere"),
    Faulty("D1-packing", 1, "sheet-through"),
    Faulty("D2-squared-alpha", 1, "sheet-through"),
    Faulty("D2-one-step-early", 1, "sheet-through"),
    Faulty("C1-srgb-twice", 1, "bright-on-grey"),
    Faulty("C1-srgb-twice", 1, "grey-slab"),
    Faulty("C1-srgb-never", 1, "bright-on-grey"),
    Faulty("C1-wrong-space", 1, "bright-on-grey"),
    Faulty("B1-blended-twice", 1, "on-a-background"),
    Faulty("N1-sign", 1, "lit-sphere"),
    Faulty("N1-space", 1, "lit-turned"),
    Faulty("N1-kernel", 1, "lit-sphere"),
    Faulty("N1-kernel", 1, "lit-turned"),
    Faulty("N1-zero", 1, "lit-turned"),
    Faulty("N1-flat-skipped", 1, "lit-turned"),
    Faulty("N1-zero", 1, "lit-sphere"),
    Faulty("N1-flat-skipped", 1, "lit-sphere"),
    Faulty("M1-average", 1, "checkers"),
    Faulty("M1-maximum", 1, "checkers"),
    # Weak ones: what is a hundredth, a twentieth, one part in many.
    Faulty("G1-half-voxel", 0.02, "f-shape"),
    Faulty("G1-moved-box", 0.02, "turned"),
    Faulty("O1-stale", 1.02, "long-voxels-y"),
    Faulty("O3-factor-per-sample", 0.98, "long-voxels-y"),
    Faulty("T1-early-stop", 0.98, "bright-back"),
    Faulty("T1-not-renormalised", 0.98, "bright-back"),
    Faulty("T3-loop-cap", 0.9, "long-rays"),
    Faulty("T4-step", 1.01, "bright-back"),
    Faulty("J1-biased-jitter", 0.45, "thin-slab"),
    Faulty("L1-half-texel", 0.02, "two-entries"),
    Faulty("L2-short-table", 128, "spike"),
    Faulty("L2-quantised-table", 6, "two-entries"),
    Faulty("L2-quantised-table", 6, "spike"),
    Faulty("D1-range", 1.01, "stripes-behind"),
    Faulty("D1-range", 1.01, "wide-sphere"),
)
