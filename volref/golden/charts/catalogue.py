"""All test charts, by name."""

from volref.emulation.catalogue import named
from volref.golden.charts import light, places, surroundings
from volref.golden.charts.chart import Chart

BASELINE = named("texture3d")
SHORT = BASELINE.with_switches("texture3d-2-entries", table={"size": 2})
FLOATS = BASELINE.with_switches(
    "texture3d-floats", volume={"format": "float"}, table={"format": "float", "size": 2048}
)

# Fewer steps than in the catalogue: faults of a step are larger, and charts are drawn sooner.
CONGOTE = named("congote2012").with_switches("congote2012-64-steps", stepping={"steps": 64})
CLAMPED = CONGOTE.with_switches(
    "congote2012-64-steps-clamped",
    volume={"in_tile": "clamped", "slices": "centers", "second_slice": "clamped"},
)
ARBELAZ = named("arbelaz2016").with_switches("arbelaz2016-48-steps", stepping={"steps": 48})
PAGE = named("barbagallo").with_switches(
    "barbagallo-64-steps", stepping={"steps": 64}, opacity={"factor": 12.8}
)
BURKALO = named("burkalo2022")
CEJ = named("cej2020").with_switches("cej2020-24-steps", stepping={"steps": 24})

_ALL = (
    Chart(
        "f-shape", "an F that no mirror makes one again", places.f_shape, BASELINE, ("G1", "G2", "G4", "G6")
    ),
    Chart("f-atlas", "the F in an atlas of 4 x 3 tiles", places.f_atlas, CONGOTE, ("A1", "A2", "A3")),
    Chart("ramp-by-bright", "a ramp along z by bright slices", places.ramp_by_bright, CONGOTE, ("A2", "A3")),
    Chart("full-tiles", "an atlas whose tiles are full to their edges", places.full_tiles, CONGOTE, ("A3",)),
    Chart("clamped-tiles", "the same, held half a texel inside", places.full_tiles, CLAMPED, ("A3",)),
    Chart("turned", "the F of long voxels, turned and moved", places.turned, BASELINE, ("G3", "G5")),
    Chart("checkers", "values that jump from voxel to voxel", places.checkers, BASELINE, ("F1", "L3", "M1")),
    Chart("no-data", "a hole without values in a slab", places.no_data, BASELINE, ("F4",)),
    Chart(
        "opaque-border", "a hollow box with dense faces", light.opaque_border, BASELINE, ("T2", "G1", "G2")
    ),
    Chart("thin-slab", "a leaf one voxel thick", light.thin_slab, BASELINE, ("T4", "T2", "F1")),
    Chart("long-voxels-x", "long voxels, seen along them", light.long_voxels_x, BASELINE, ("G3", "O1", "O4")),
    Chart("long-voxels-y", "the same across", light.long_voxels_y, BASELINE, ("G3", "O1", "O4")),
    Chart("bright-back", "a dense front before a bright back", light.bright_back, BASELINE, ("T1", "O2")),
    Chart("long-rays", "a rod along its length", light.long_rays, BASELINE, ("T3", "T1")),
    Chart("grey-slab", "one value up to the faces", light.grey_slab, BASELINE, ("O1", "O3", "T2", "C1")),
    Chart("inside", "an eye within the box", light.inside, BASELINE, ("G5",)),
    Chart("two-entries", "waves through a table of two entries", light.two_entries, SHORT, ("L1", "L2")),
    Chart("spike", "waves through a narrow spike", light.spike, BASELINE, ("L2", "L3", "T4")),
    Chart("fine-values", "values finer than 8 bits", light.fine_values, FLOATS, ("F2",)),
    Chart(
        "on-a-background",
        "a ball on a glassy background",
        surroundings.on_a_background,
        BASELINE,
        ("B1", "O5", "C1"),
    ),
    Chart(
        "stripes-behind", "a thin haze before stripes", surroundings.stripes_behind, BASELINE, ("D1", "O3")
    ),
    Chart(
        "wide-sphere",
        "a ball of triangles under a wide angle",
        surroundings.wide_sphere,
        ARBELAZ,
        ("D1", "D2"),
    ),
    Chart("sheet-through", "a sheet through a haze", surroundings.sheet_through, ARBELAZ, ("D1", "D2", "B1")),
    Chart(
        "values-as-opacity",
        "the F in a haze, by its values",
        surroundings.values_as_opacity,
        PAGE,
        ("A3", "O2", "L3"),
    ),
    Chart(
        "bright-on-grey",
        "the F through tone map and gamma",
        surroundings.bright_on_grey,
        BURKALO,
        ("C1", "O1"),
    ),
    Chart("lit-sphere", "a lit ball, a mean of 2 frames", surroundings.lit_sphere, CEJ, ("N1", "J1"), 2),
    Chart("lit-turned", "a lit ball of long voxels", surroundings.lit_turned, CEJ, ("N1", "J1"), 1),
)

CHARTS: dict[str, Chart] = {chart.name: chart for chart in _ALL}
