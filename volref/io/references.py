"""References: what another process needs to read a volume again and to know that it is the same one.

A volume goes to workers as the path of its file and the SHA-256 of what the file holds, never as an array.
"""

import hashlib
import pickle
import socket
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from volref.errors import FormatError
from volref.io.guard import Foreign, one_line
from volref.io.scene_parts import document_of_placement
from volref.io.volumes import file_state, origin_of, read_again
from volref.scene.volume import Volume

# The environment variable that names a folder which every worker can read.
SHARED = "VOLREF_SHARED"

# Data up to this many bytes are sent as they are; more are put into a file.
LARGEST_MESSAGE = 1 << 18

# Makes the folder for files that have to be written, when the first one is.
Folder = Callable[[], Path]


@dataclass(frozen=True)
class FileReference:
    """A file by its path and by the SHA-256 of what it holds."""

    path: str
    sha256: str

    def checked(self) -> Path:
        """Return the path after checking that this process can read it and that it holds the same.

        Raises
        ------
        FormatError
            If it cannot, or does not.
        """
        path = Path(self.path)
        try:
            found = _sha256(path, file_state(path))
        except OSError as error:
            message = f"{one_line(self.path)} must be a file that every worker can read, got "
            message += f"{one_line(error.strerror or str(error))} on {socket.gethostname()}; "
            message += f"keep it in a folder that all machines share, and name one for new files in {SHARED}"
            raise FormatError(message) from error
        if found == self.sha256:
            return path
        message = (
            f"{one_line(self.path)} must stay as it is while it is rendered, got SHA-256 {found[:12]} in "
        )
        raise FormatError(message + f"place of {self.sha256[:12]}; load it and render again")


# Pickled data, or the file that holds them.
Message = bytes | FileReference


@dataclass(frozen=True)
class VolumeReference:
    """A file, and how `read_again` makes a volume of it."""

    file: FileReference
    reading: bytes


def refer_to_volume(volume: Volume, folder: Folder) -> VolumeReference:
    """Return a reference to the file that `volume` was loaded from; if it has none, or it changed, write one.

    Raises
    ------
    FormatError
        If nothing can be written to the folder.
    """
    origin = origin_of(volume)
    if origin is not None and _state_of(origin.path) == origin.state:
        file = FileReference(str(origin.path), _sha256(origin.path, origin.state))
        reading = origin.nan, origin.own
    else:
        path = folder() / "volume.npy"
        if not path.exists():
            with _writing(path):
                np.save(path, volume.values, allow_pickle=False)
        file, reading = _refer_to(path), ("refuse", {})
    return VolumeReference(file, pickle.dumps((*reading, document_of_placement(volume))))


@lru_cache(maxsize=2)
def fetch_volume(reference: VolumeReference) -> Volume:
    """Return the volume that a reference stands for; the last ones are kept.

    Raises
    ------
    FormatError
        If its file cannot be read here, or holds something else by now.
    """
    nan, own, placement = pickle.loads(reference.reading)
    return read_again(reference.file.checked(), nan, own, placement)


def pack(data: object, folder: Folder) -> Message:
    """Return data ready to be sent: pickled, and in a file if they are many."""
    content = zlib.compress(pickle.dumps(data), level=1)
    if len(content) <= LARGEST_MESSAGE:
        return content
    path = folder() / f"{hashlib.sha256(content).hexdigest()}.pickle"
    with _writing(path):
        path.write_bytes(content)
    return _refer_to(path)


def unpack(message: Message) -> Foreign:
    """Return the data of a message.

    Raises
    ------
    FormatError
        If their file cannot be read here, or holds something else.

    Examples
    --------
    >>> unpack(pack({"step": 0.5}, Path))
    {'step': 0.5}
    """
    content = message if isinstance(message, bytes) else message.checked().read_bytes()
    return pickle.loads(zlib.decompress(content))


def _refer_to(path: Path) -> FileReference:
    return FileReference(str(path), _sha256(path, file_state(path)))


def _state_of(path: Path) -> tuple[int, ...] | None:
    try:
        return file_state(path)
    except OSError:
        return None


@lru_cache(maxsize=8)
def _sha256(path: Path, _state: tuple[int, ...]) -> str:
    """Return the SHA-256 of a file, computed once for each of its states."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        message = f"{one_line(str(path.parent))} must have room for what workers are to read, got "
        message += f"{one_line(error.strerror or str(error))}; name another folder in {SHARED}"
        raise FormatError(message) from error
