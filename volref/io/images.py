"""Images from and to files: PNG for people, EXR for other programs, .npy and .npz exact."""

from pathlib import Path

import numpy as np

from volref.arrays import Floats, Numbers, float_array, one_of
from volref.errors import FormatError
from volref.image import (
    ENCODINGS,
    decode_light,
    encode_rgba8,
    premultiplied_from_straight,
    straight_from_premultiplied,
)
from volref.io.exr import read_exr, write_exr
from volref.io.guard import DEFAULT_MAX_BYTES, existing_file, one_line
from volref.io.npy import chosen_array, npz_headers, read_npy, read_npz, write_npy, write_npz
from volref.io.png import read_png, write_png

ALPHAS = ("straight", "premultiplied")


def read_image(
    path: str | Path,
    *,
    encoding: str | None = None,
    alpha: str | None = None,
    max_bytes: int = DEFAULT_MAX_BYTES,
) -> Floats:
    """Return the premultiplied working-space image (height, width, 4) in a .png, .exr, .npy or .npz file.

    Integers are codes: divided by the largest of their type, then decoded.  Grey and RGB get alpha 1.

    Parameters
    ----------
    encoding
        "srgb", "gamma2.2" or "none": how the colours are encoded.  Default "srgb" for integers,
        "none" for floats.
    alpha
        "straight" or "premultiplied": what the file holds.  Default "straight" for integers,
        "premultiplied" for floats.  A premultiplied code is the encoded colour times alpha, as a browser's
        canvas has it.
    max_bytes
        The most memory to use.

    Raises
    ------
    FormatError
        If the file is no such image; 16-bit colour PNG is refused.
    """
    codes = read_codes(path, max_bytes)
    whole = codes.dtype.kind in "iu"
    encoding = one_of("encoding", encoding or ("srgb" if whole else "none"), ENCODINGS)
    alpha = one_of("alpha", alpha or ("straight" if whole else "premultiplied"), ALPHAS)
    unit = codes / np.iinfo(codes.dtype).max if whole else codes
    rgba = np.array(float_array(Path(path).name, _four_channels(unit), ("height", "width", 4)))
    if alpha == "premultiplied" and encoding == "none":
        return rgba
    straight = straight_from_premultiplied(rgba) if alpha == "premultiplied" else rgba
    straight[..., :3] = decode_light(straight[..., :3], encoding)
    return premultiplied_from_straight(straight)


def read_codes(path: str | Path, max_bytes: int = DEFAULT_MAX_BYTES) -> Numbers:
    """Return what a .png, .exr, .npy or .npz file holds: (height, width[, 3 or 4]) codes or floats.

    Nothing is scaled, decoded or multiplied.

    Raises
    ------
    FormatError
        If the file is no such image.
    """
    file = existing_file(path)
    suffix = file.suffix.lower()
    if suffix == ".png":
        return read_png(file, max_bytes)
    if suffix == ".exr":
        codes = read_exr(file, max_bytes)
        codes = codes[..., 0] if codes.shape[2] == 1 else codes
    elif suffix == ".npy":
        codes = read_npy(file, max_bytes)
    elif suffix == ".npz":
        name = chosen_array(file, npz_headers(file), None, "rgba", 3)
        codes = read_npz(file, (name,), max_bytes)[name]
    else:
        message = f"{one_line(file.name)} must end in .png, .exr, .npy or .npz, got {suffix!r}; "
        raise FormatError(message + "convert it to PNG")
    image = codes.ndim == 2 or (codes.ndim == 3 and codes.shape[2] in (3, 4))
    if not image or codes.dtype.kind not in "uf":
        message = (
            f"{file.name} must hold an image (height, width[, 3 or 4]) of unsigned integers or floats, got "
        )
        raise FormatError(message + f"{codes.dtype} of shape {codes.shape}; save another array")
    return codes


def write_image(path: str | Path, rgba: Floats, *, encoding: str = "srgb", overwrite: bool = False) -> None:
    """Write a premultiplied working-space image (height, width, 4) to a file, by its suffix.

    .npy and .npz hold it as it is, .exr rounded to float32, .png encoded.

    Raises
    ------
    FormatError
        If the suffix is another one, or the file exists and `overwrite` is False.
    """
    image = float_array("image", rgba, ("height", "width", 4))
    suffix = Path(path).suffix.lower()
    if suffix == ".png":
        write_png(path, encode_rgba8(image, encoding), overwrite=overwrite)
    elif suffix == ".exr":
        write_exr(path, image, overwrite=overwrite)
    elif suffix == ".npy":
        write_npy(path, image, overwrite=overwrite)
    elif suffix == ".npz":
        write_npz(path, {"rgba": image}, overwrite=overwrite)
    else:
        message = f"{one_line(Path(path).name)} must end in .png, .exr, .npy or .npz, got {suffix!r}; "
        raise FormatError(message + "rename it")


def _four_channels(unit: Numbers) -> Numbers:
    if unit.ndim == 2:
        unit = np.repeat(unit[..., None], 3, axis=2)
    if unit.shape[2] == 4:
        return unit
    return np.concatenate([unit, np.ones((*unit.shape[:2], 1))], axis=2)
