# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false
"""Settings with which HDF5 opens files: format, locks and retries."""

import ctypes
import io
import os
import struct
import sys
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast

import h5py
import h5py.h5f
import h5py.h5p

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer

h5f, h5p = cast(Any, h5py.h5f), cast(Any, h5py.h5p)

# The oldest format in which a file can be read while it is being written. It is fixed, so that older tools can read
# files of newer writers.
VERSIONS = ("v110", "v110")

RETRIES = 28
"""Number of attempts to read metadata of a file that is being written; the pauses between them double, starting at 1
ns, and last 0.3 s in total.

With HDF5's default of 100 attempts, reading a file that another program has truncated would practically never end, and
would block the whole process, including the drive.
"""


def locking(system: str = sys.platform) -> Literal["best-effort"] | bool:
    """Locking mode with which h5py opens every file except one that is being written.

    A file that is being written is not locked on any system, neither by its writer nor by a reader that follows it: a
    lock between creation and the change to single-writer mode would make the writer fail. That mode and creation
    without replacement protect the file.
    On Windows locks are mandatory: a reader of a file that is being written would make its writer fail at the next
    flush or at the end, with errno 13. No locks are used there. Elsewhere locks are advisory, and network shares may
    not support them.
    """
    return False if system == "win32" else "best-effort"


def open_living(path: Path) -> Any:
    """Open, for reading in single-writer mode, a file that is being written."""
    return _opened(path, h5f.ACC_RDONLY | h5f.ACC_SWMR_READ)


CHUNK_CACHE, CHUNK_SLOTS = 2**17, 127
"""Memory in which HDF5 keeps chunks of each dataset of a file being written [bytes], and number of their places.

Only the last, incomplete chunk is needed again. HDF5's default is 8 MB for each dataset, which a long run fills.
"""


def open_to_write(path: Path) -> Any:
    """Open a new file, which its creator has closed, in single-writer mode to append to its datasets.

    Switching an open file to this mode instead would leave HDF5's default number of attempts in effect.
    """
    return _opened(path, h5f.ACC_RDWR | h5f.ACC_SWMR_WRITE, CHUNK_CACHE)


def _opened(path: Path, mode: int, cache: int | None = None) -> Any:
    made = h5p.create(h5p.FILE_ACCESS)
    if cache is not None:
        made.set_cache(0, CHUNK_SLOTS, cache, 1.0)
    made.set_libver_bounds(h5f.LIBVER_V110, h5f.LIBVER_V110)
    made.set_alignment(1, 1)
    made.set_file_locking(False, ignore_when_disabled=True)
    if (limit := _retry_limit()) is not None:
        limit(made.id, RETRIES)
    return h5py.File(h5f.open(os.fsencode(path), mode, fapl=made))


@lru_cache(maxsize=1)
def _retry_limit() -> Any:
    """The function of the HDF5 library that limits retries, which h5py does not expose; None if it is not found."""
    for library in (cast(str, h5p.__file__), str(Path(h5py.__file__).parent / "hdf5.dll")):
        try:
            found = ctypes.CDLL(library).H5Pset_metadata_read_attempts
        except (OSError, AttributeError):
            continue
        found.argtypes, found.restype = [ctypes.c_int64, ctypes.c_uint], ctypes.c_int
        return found
    return None


_SIGNATURE = b"\x89HDF\r\n\x1a\n"

_SUPERBLOCK = struct.Struct("<8s4B4QI")


def is_let_go(path: Path) -> bool:
    """Whether the writer has closed the file; also True for a file with another layout or a damaged superblock."""
    head = _superblock(path)
    return head is None or head[4] == 0 or lookup3(_SUPERBLOCK.pack(*head)[:-4]) != head[-1]


MISSING = b"\xff"
"""Byte returned for every position beyond the end of the file. A string heap has no checksum, and HDF5 would loop for
ever in a heap of zeros.
"""


class Quiet(io.RawIOBase):
    """A file presented to HDF5 as if its writer had closed it, with the length stated in its superblock, if plausible;
    missing bytes are read as `MISSING`.

    In metadata such bytes fail the checksums. Uncompressed values have no checksums: their readers must first determine
    where they end with `bench.datafile.opening`.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open("rb")
        self._place, self._head = 0, b""
        self._size = path.stat().st_size
        if (head := _superblock(path)) is not None:
            *front, _, base, extension, end, root, _ = head
            self._size = max(self._size, min(end, 2 * self._size + 2**24))
            fields = _SUPERBLOCK.pack(*front, 0, base, extension, self._size, root, 0)[:-4]
            self._head = fields + struct.pack("<I", lookup3(fields))

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = io.SEEK_SET, /) -> int:
        self._place = offset + (0, self._place, self._size)[whence]
        return self._place

    def tell(self) -> int:
        return self._place

    def readinto(self, buffer: "WriteableBuffer", /) -> int:
        target = memoryview(buffer).cast("B")
        self._file.seek(self._place)
        # always return the requested number of bytes, even beyond the end; otherwise h5py would repeat the request for
        # ever
        wanted = len(target)
        found = self._file.read(wanted).ljust(wanted, MISSING)
        covered = self._head[self._place :][:wanted]
        target[:wanted] = covered + found[len(covered) :]
        self._place += wanted
        return wanted

    def close(self) -> None:
        self._file.close()
        super().close()


_32_BITS = 0xFFFFFFFF


def lookup3(data: bytes) -> int:
    """Jenkins' lookup3 hash, as used by HDF5, of bytes whose number is a multiple of 4."""
    a = b = c = (0xDEADBEEF + len(data)) & _32_BITS
    words = list(struct.unpack(f"<{len(data) // 4}I", data))
    while len(words) > 3:
        a, b, c = (a + words[0]) & _32_BITS, (b + words[1]) & _32_BITS, (c + words[2]) & _32_BITS
        for turn in (4, 6, 8, 16, 19, 4):
            a = ((a - c) & _32_BITS) ^ _rotated(c, turn)
            c = (c + b) & _32_BITS
            a, b, c = b, c, a
        words = words[3:]
    a, b, c = ((x + y) & _32_BITS for x, y in zip((a, b, c), [*words, 0, 0], strict=False))
    for turn in (14, 11, 25, 16, 4, 14, 24):
        c = ((c ^ b) - _rotated(b, turn)) & _32_BITS
        a, b, c = b, c, a
    return b


def _rotated(value: int, bits: int) -> int:
    return ((value << bits) | (value >> (32 - bits))) & _32_BITS


def _superblock(path: Path) -> tuple[Any, ...] | None:
    with path.open("rb") as file:
        head = file.read(_SUPERBLOCK.size)
    if len(head) < _SUPERBLOCK.size or not head.startswith(_SIGNATURE) or head[8] not in (2, 3):
        return None
    return _SUPERBLOCK.unpack(head)
