"""Where faults were seen: issues of real renderers, and the systems in docs/systems, by rows of the table."""

SEEN = {
    "A1": "x3dom#802; Congote 2012, eq. 8 and 10",
    "A2": "AllenCell/vole-core#30",
    "A3": "lebarba/WebGLVolumeRendering#8; Congote 2012, eq. 17",
    "G1": "vispy#2239, pygfx#177",
    "G2": "the ANARI specification",
    "G3": "inviwo#118, Slicer#3716",
    "G4": "sciview#362, niivue#734",
    "G5": "three.js#17648, three.js#18781",
    "G6": "idetik#556, gvdb-voxels#75",
    "O1": "vtk-js#3134, neuroglancer#503; Congote 2012, eq. 1",
    "O2": "lebarba/WebGLVolumeRendering#2; Congote 2012, eq. 4; Barbagallo's article",
    "O3": "niivue/mono#187",
    "O4": "yt#1133, visit#5016",
    "O5": "pytorch3d#729, VisRTX#160; Barbagallo",
    "T1": "instant-ngp#384; Arbelaz 2016, Burkalo 2022",
    "T2": "vtk-js#1146, inviwo#83",
    "T3": "x3dom#540; Arbelaz 2016",
    "T4": "vtk-js#3134",
    "J1": "vtk-js#413, Viskores#446",
    "L1": "three.js#33842, megamol#837",
    "L2": "Viskores#446",
    "L3": "Barbagallo",
    "F1": "cornerstone3D#2810",
    "F2": "vtk-js#2786, itk-vtk-viewer#272",
    "F3": "cesium#12075; Barbagallo",
    "F4": "vtk-js#334",
    "D1": "Viskores#412, scenery#149; Arbelaz 2016",
    "D2": "Arbelaz 2016",
    "C1": "pygfx#329; Burkalo 2022",
    "B1": "webgl-volume-raycaster#14; Arbelaz 2016",
    "N1": "glance#29; Cej 2020",
    "M1": "vtk-js#1093",
}


def row_of(key: str) -> str:
    """Return the row of a fault's key.

    Examples
    --------
    >>> row_of("O1-uncorrected"), SEEN[row_of("M1-average")]
    ('O1', 'vtk-js#1093')
    """
    return key.partition("-")[0]
