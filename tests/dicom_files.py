"""DICOM series as pydicom writes them: files in shuffled order, with InstanceNumbers that mislead."""

import numpy as np
import pydicom
from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian


def dicom_slice(codes, affine, k, *, series="1.2.3", **change):
    """Return slice k of a series that lies by a matrix from (i, j, k) to LPS; None removes an element."""
    data = pydicom.Dataset()
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    unit = affine[:3, :3] / spacing
    elements = {
        "SOPClassUID": CTImageStorage,
        "SOPInstanceUID": f"{series}.{k + 1}",
        "SeriesInstanceUID": series,
        "Modality": "CT",
        "InstanceNumber": (7 * k + 3) % 11,
        "ImagePositionPatient": [f"{x:.10f}"[:16] for x in (affine @ [0, 0, k, 1])[:3]],
        "ImageOrientationPatient": [f"{x:.13f}"[:16] for x in (*unit[:, 0], *unit[:, 1])],
        "PixelSpacing": [float(spacing[1]), float(spacing[0])],
        "SliceThickness": float(spacing[2]),
        "Rows": codes.shape[0],
        "Columns": codes.shape[1],
        "SamplesPerPixel": 1,
        "PhotometricInterpretation": "MONOCHROME2",
        "BitsAllocated": 8 * codes.dtype.itemsize,
        "BitsStored": 8 * codes.dtype.itemsize,
        "HighBit": 8 * codes.dtype.itemsize - 1,
        "PixelRepresentation": int(codes.dtype.kind == "i"),
        "PixelData": codes.tobytes() + b"\0" * (codes.nbytes % 2),
    }
    for name, value in (elements | change).items():
        if value is not None:
            setattr(data, name, value)
    data["PixelData"].VR = "OB" if codes.dtype.itemsize == 1 else "OW"
    data.file_meta = pydicom.dataset.FileMetaDataset()
    data.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
    data.file_meta.MediaStorageSOPClassUID = CTImageStorage
    data.file_meta.MediaStorageSOPInstanceUID = data.SOPInstanceUID
    return data


def write_series(folder, values, affine, *, seed=5, name="slice", **change):
    """Write a series, one file per slice; file names and InstanceNumbers say nothing of the places."""
    order = np.random.default_rng(seed).permutation(len(values))
    for number, k in enumerate(order):
        data = dicom_slice(values[k], affine, int(k), **change)
        data.save_as(folder / f"{name}{number}.dcm", enforce_file_format=True)
    return folder
