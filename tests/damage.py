"""Ways to damage a file, each decided by a seed: the same seed damages the same bytes in the same way.

`damaged(data, rng)` damages bytes; `damage_path(path, rng)` a file, or one file of a folder.  Where a format
packs its contents (gzip, ZIP), half of the damage is done inside and packed again, so that it gets past the
check sums; where it has text, numbers in the text are changed.
"""

import gzip
import io
import re
import zipfile

LENGTHS = (1, 2, 4, 8)
NUMBERS = (0, 1, 2, 3, 7, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 10**6, 2**31 - 1, 2**31, 2**32 - 1)
NUMBERS += (10**12, 2**53 + 1, 2**62, 2**63 - 1, 2**64 - 1)
TEXTS = (b"0", b"-1", b"1", b"2", b"3", b"1000000", b"1000000000000000", b"2147483648", b"1e308", b"-1e-320")
TEXTS += (b"nan", b"inf", b"0.5", b"99999999999999999999999999999999999999999999", b"null", b"[]", b'"x"')


def damaged(data, rng):
    """Return bytes with one to three kinds of damage."""
    for _ in range(rng.integers(1, 4)):
        way = WAYS[rng.integers(len(WAYS))]
        data = way(data, rng)
    return data


def damage_path(path, rng):
    """Damage a file in place, or one file of a folder."""
    if path.is_dir():
        files = sorted(file for file in path.rglob("*") if file.is_file())
        path = files[rng.integers(len(files))]
    data = path.read_bytes()
    inside = INSIDE.get(data[:2]) if rng.random() < 0.5 else None
    path.write_bytes(inside(data, rng) if inside else damaged(data, rng))


def _place(data, rng, length=0):
    """Return where to damage: half of the time near the beginning, where headers are."""
    most = max(len(data) - length, 0) + 1
    return int(rng.integers(min(most, 512) if rng.random() < 0.5 else most))


def _flip_bits(data, rng):
    data = bytearray(data)
    for _ in range(rng.integers(1, 5) if data else 0):
        data[min(_place(data, rng), len(data) - 1)] ^= 1 << int(rng.integers(8))
    return bytes(data)


def _noise(data, rng):
    at, count = _place(data, rng), int(rng.integers(1, 17))
    return data[:at] + rng.bytes(count) + data[at + count :]


def _insert(data, rng):
    at = _place(data, rng)
    return data[:at] + rng.bytes(int(rng.integers(1, 17))) + data[at:]


def _remove(data, rng):
    at = _place(data, rng)
    return data[:at] + data[at + int(rng.integers(1, 17)) :]


def _cut(data, rng):
    return data[: _place(data, rng)]


def _repeat(data, rng):
    at, count = _place(data, rng), int(rng.integers(1, 257))
    return data[: at + count] + data[at:]


def _binary_number(data, rng):
    """Put a number of some length and byte order where it may be one of the header's."""
    length = LENGTHS[rng.integers(len(LENGTHS))]
    number = NUMBERS[rng.integers(len(NUMBERS))] % 256**length
    # Numbers of headers are mostly aligned.
    at = _place(data, rng, length) // length * length
    order = "little" if rng.random() < 0.7 else "big"
    return data[:at] + number.to_bytes(length, order) + data[at + length :]


def _text_number(data, rng):
    """Replace a number that stands as text."""
    found = list(re.finditer(rb"-?\d+(\.\d+)?", data))
    if not found:
        return _binary_number(data, rng)
    match = found[rng.integers(len(found))]
    return data[: match.start()] + TEXTS[rng.integers(len(TEXTS))] + data[match.end() :]


WAYS = (_flip_bits, _noise, _insert, _remove, _cut, _repeat, _binary_number, _binary_number, _text_number)
WAYS += (_text_number,)


def _inside_gzip(data, rng):
    return gzip.compress(damaged(gzip.decompress(data), rng), mtime=0)


def _inside_zip(data, rng):
    """Damage one member of an archive and write the archive anew."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = [(info.filename, info.compress_type, archive.read(info)) for info in archive.infolist()]
    chosen, stream = rng.integers(len(members)), io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for number, (name, packing, inner) in enumerate(members):
            archive.writestr(name, damaged(inner, rng) if number == chosen else inner, packing)
    return stream.getvalue()


INSIDE = {b"\x1f\x8b": _inside_gzip, b"PK": _inside_zip}
