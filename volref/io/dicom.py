"""DICOM series: a folder of slices, each a file that says where it lies.

Slices are sorted by their place along the normal of the images, never by file name or InstanceNumber.  With
o the ImagePositionPatient of a slice, r and c the two halves of its ImageOrientationPatient and (dr, dc) its
PixelSpacing (between rows, between columns), voxel (i, j) of the slice lies at

    o + i dc r + j dr c        (DICOM PS3.3, equation C.7.6.2.1-1, in LPS)

and voxel k of the series one step further, the step from slice to slice being whatever the positions say: a
tilted gantry gives a sheared grid, which is kept.
"""

from collections import Counter
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from volref.arrays import Floats, Numbers
from volref.errors import FormatError
from volref.io.dicom_codes import Slices, numbers_of, voxels_of_slices
from volref.io.guard import Foreign, extra, nearest, one_line, wrapped
from volref.io.placement import SIGNS, placement_of_affine

# Positions are decimal texts of up to 16 characters, often rounded to 1e-3 mm: a slice may lie this share of
# the distance between slices beside its place on an even grid.
UNEVEN = 0.01
# Orientations and pixel spacings are the same numbers, copied; some writers round to 6 digits.
UNLIKE = 1e-4

NEEDED = (
    *("Rows", "Columns", "BitsAllocated", "SeriesInstanceUID"),
    *("ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing"),
)
DEFLATED = "1.2.840.10008.1.2.1.99"
FOLDER_RECORD = "1.2.840.10008.1.3.10"
MOST_LISTED = 6


def read_dicom(path: Path, key: object, max_bytes: int) -> tuple[Numbers, dict[str, Any]]:
    """Return the voxels (nz, ny, nx) of a DICOM series and where they lie, in RAS.

    `path` is a folder, or one slice, which stands for its series in its folder.  Stored codes where nothing
    has to be rescaled; integers where slope and intercept are whole; else code * slope + intercept in
    float64, as the standard's modality transformation says (PS3.3, C.11.1.1.2).

    Parameters
    ----------
    key
        SeriesInstanceUID, needed where a folder holds several series.

    Raises
    ------
    FormatError
        If there is no such series, it is not one even grid of grey slices, or it needs too much memory.
    """
    folder = path if path.is_dir() else path.parent
    files = _dicom_files(folder, path)
    pydicom = extra("pydicom", "DICOM", "pydicom")
    headers = [(file, _header(pydicom, file)) for file in files]
    series = _chosen_series(path, [found for found in headers if _is_image(found[1])], key)
    for file, header in series:
        _check_slice(pydicom, file, header)
    _check_alike(series)
    series, affine = _sorted(series)
    return voxels_of_slices(pydicom, series, max_bytes), placement_of_affine(affine, SIGNS["lps"])


def _dicom_files(folder: Path, path: Path) -> list[Path]:
    """Return the files of a folder that are DICOM: the letters DICM stand at byte 128."""
    with wrapped(folder, "folder", "check the path"):
        files = sorted(file for file in folder.iterdir() if file.is_file() and file.name[0] != ".")
        found = [file for file in files if _starts_as_dicom(file)]
    strangers = [file for file in files if file.suffix.lower() == ".dcm" and file not in found]
    if strangers:
        message = f"{strangers[0].name} must be a DICOM file (DICM at byte 128), got other bytes; "
        raise FormatError(message + "write it again, or move it to another folder")
    if not found:
        message = f"{path.name} must be a folder of DICOM slices, got a folder without any; check the path"
        raise FormatError(message)
    return found


def _starts_as_dicom(file: Path) -> bool:
    with file.open("rb") as stream:
        return stream.read(132)[128:] == b"DICM"


def _header(pydicom: ModuleType, file: Path) -> Foreign:
    """Return the data set of a file up to its pixels, every element of which this module reads decoded."""
    with wrapped(file, "DICOM file"):
        meta = pydicom.filereader.read_file_meta_info(str(file))
        if meta.get("TransferSyntaxUID") == DEFLATED:
            # Inflated as a whole before anything can be checked.
            message = f"{file.name} must not be deflated as a whole (transfer syntax {DEFLATED}), got that; "
            raise FormatError(message + "convert it to Explicit VR Little Endian")
        return pydicom.dcmread(str(file), stop_before_pixels=True)


def _is_image(header: Foreign) -> bool:
    return bool(header.file_meta.get("MediaStorageSOPClassUID") != FOLDER_RECORD)


def _chosen_series(path: Path, found: Slices, key: object) -> Slices:
    """Return the slices of the series meant: `key`, else that of the file named, else the only one."""
    with wrapped(path, "DICOM series"):
        uids = [str(header.get("SeriesInstanceUID", "")) for _, header in found]
    counts = Counter(uids)
    if key is not None:
        wanted = str(key)
    elif path.is_file():
        wanted = next((uid for uid, (file, _) in zip(uids, found, strict=True) if file == path), "")
    else:
        wanted = uids[0] if len(counts) == 1 else ""
    if wanted in counts:
        return [one for one, uid in zip(found, uids, strict=True) if uid == wanted]
    if key is not None:
        message = f"{path.name} must hold the series that key names, got key={one_line(repr(key))}; "
        raise FormatError(message + nearest(wanted, [one_line(uid) for uid in counts]))
    listed = [f"{one_line(uid)} ({count} slices)" for uid, count in sorted(counts.items())]
    more = f" and {len(listed) - MOST_LISTED} more" if len(listed) > MOST_LISTED else ""
    message = f"{path.name} must hold one DICOM series, got {', '.join(listed[:MOST_LISTED]) or 'none'}{more}"
    raise FormatError(message + "; pass key=SeriesInstanceUID")


def _check_slice(pydicom: ModuleType, file: Path, header: Foreign) -> None:
    """Refuse a file that is not one grey slice with a place."""
    with wrapped(file, "DICOM slice"):
        missing = [name for name in NEEDED if header.get(name) is None]
        frames, samples = int(header.get("NumberOfFrames") or 1), int(header.get("SamplesPerPixel") or 1)
        lookup = "ModalityLUTSequence" in header
        syntax = header.file_meta.get("TransferSyntaxUID")
        packed = syntax is not None and pydicom.uid.UID(syntax).is_encapsulated
        bits = int(header.get("BitsAllocated") or 0)
    if frames > 1:
        message = f"{file.name} must hold one slice, got {frames} frames (multi-frame DICOM); "
        raise FormatError(message + "convert it to NIfTI, or to one file per slice")
    if missing:
        message = (
            f"{file.name} must state {', '.join(missing)}, got none; export the series with its geometry"
        )
        raise FormatError(message)
    if samples != 1 or bits not in (8, 16, 32, 64):
        message = f"{file.name} must hold one grey value of 8 to 64 bits per pixel, got {samples} of {bits}; "
        raise FormatError(message + "convert it (colours and masks are not read)")
    if lookup:
        message = f"{file.name} must be rescaled by a slope and an intercept, got a Modality LUT; convert it"
        raise FormatError(message)
    if syntax is None:
        message = f"{file.name} must state its transfer syntax, got none; write the file again"
        raise FormatError(message)
    if packed:
        _check_decoder(pydicom, file, syntax)


def _check_decoder(pydicom: ModuleType, file: Path, syntax: Foreign) -> None:
    try:
        ready = pydicom.pixels.get_decoder(syntax).is_available
    except NotImplementedError:
        ready = False
    if not ready:
        message = f"{file.name} must have a transfer syntax that pydicom can decode here, got "
        message += f"{one_line(pydicom.uid.UID(syntax).name)}; install pylibjpeg[all], "
        raise FormatError(message + "or save it uncompressed")


def _check_alike(series: Slices) -> None:
    """Refuse slices that differ in size, pixel spacing or orientation."""
    first_file, first = series[0]
    for name in ("Rows", "Columns", "PixelSpacing", "ImageOrientationPatient"):
        model = numbers_of(first_file, first, name)
        for file, header in series[1:]:
            other = numbers_of(file, header, name)
            if (np.abs(other - model) > UNLIKE * np.abs(model).max()).any():
                message = f"{file.name} must have the {name} of {first_file.name}, {model.tolist()}, got "
                raise FormatError(message + f"{other.tolist()}; keep slices of one geometry in the folder")


def _sorted(series: Slices) -> tuple[Slices, Floats]:
    """Return the slices in order along their normal, and the matrix from (i, j, k) to LPS."""
    file, header = series[0]
    orientation = numbers_of(file, header, "ImageOrientationPatient")
    rows, columns = numbers_of(file, header, "PixelSpacing")
    # The normal has length 1 for any pair of unit vectors at a right angle.
    normal = np.cross(orientation[:3], orientation[3:])
    if not abs(np.linalg.norm(normal) - 1.0) < UNLIKE * 10:
        message = f"{file.name} must have two unit vectors at a right angle for ImageOrientationPatient, "
        raise FormatError(message + f"got {orientation.tolist()}; export the series again")
    positions = np.array([numbers_of(*one, "ImagePositionPatient") for one in series])
    order = np.argsort(positions @ normal, kind="stable")
    series, positions = [series[i] for i in order], positions[order]
    affine = np.eye(4)
    affine[:3, 0], affine[:3, 1] = orientation[:3] * columns, orientation[3:] * rows
    alone = len(series) == 1
    affine[:3, 2] = normal * _thickness(file, header) if alone else _step(series, positions, normal)
    affine[:3, 3] = positions[0]
    return series, affine


def _step(series: Slices, positions: Floats, normal: Floats) -> Floats:
    """Return the vector from slice to slice, after checking that they lie on an even grid."""
    count = len(series)
    along = (positions - positions[0]) @ normal
    usual = float(np.median(np.diff(along)))
    gaps = np.diff(along)
    for k in range(count - 1):
        if gaps[k] <= UNEVEN * max(usual, gaps.max()):
            message = f"{series[k + 1][0].name} must lie at a place of its own, got the place of "
            message += f"{series[k][0].name} ({one_line(str(positions[k].tolist()))}); "
            raise FormatError(message + "keep one time, echo and phase of the series in the folder")
    step: Floats = (positions[-1] - positions[0]) / (count - 1)
    beside = np.linalg.norm(positions - (positions[0] + np.arange(count)[:, None] * step), axis=1)
    if beside.max() > UNEVEN * usual:
        k = int(np.argmax(np.abs(gaps - usual)))
        message = f"{series[k + 1][0].name} must lie {usual:g} after {series[k][0].name}, in line with the "
        message += f"other slices, got {gaps[k]:g}; add the slices that are missing, or keep one even stack"
        raise FormatError(message)
    return step


def _thickness(file: Path, header: Foreign) -> float:
    """Return the distance that a series of one slice states."""
    for name in ("SpacingBetweenSlices", "SliceThickness"):
        if header.get(name) is not None:
            return abs(float(numbers_of(file, header, name)[0]))
    message = f"{file.name} must state SliceThickness if it is the only slice, got none; "
    raise FormatError(message + "add the other slices")
