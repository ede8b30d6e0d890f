"""The first bytes of an HDF5 file: whether a writer let go of it, and a view of it as if one had.

A reader in single-writer mode takes a wrong checksum for a write on its way and tries again, at last for hours: a file
that a power failure left half written would hang it. Without that mode HDF5 refuses what no writer has let go of. So
what is to be judged or recovered is read through a view in which the mark is gone. The file itself is only read.

Source: HDF5 File Format Specification 3.0, section II.A (superblock versions 2 and 3) and appendix on checksums
(Jenkins, lookup3).
"""

import io
import struct
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_LAYOUT = struct.Struct("<8s4B4QI")
_MASK = 0xFFFFFFFF


def is_let_go(path: Path) -> bool:
    """Whether no writer has the file open or died with it; also for what is no file of this layout, or damaged here."""
    head = _head(path)
    return head is None or head[4] == 0 or checksum(_LAYOUT.pack(*head)[:-4]) != head[-1]


class Quiet(io.RawIOBase):
    """A file as if its writer had closed it, as long as its superblock says it must be; what is missing is zeros.

    What describes the file has checksums, which zeros do not pass. Values that are not packed have none: whoever reads
    them must ask `bench.record.extent` first where they end.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open("rb")
        self._place, self._head = 0, b""
        self._size = path.stat().st_size
        if (head := _head(path)) is not None:
            *front, _, base, extension, end, root, _ = head
            self._size = max(self._size, min(end, 2 * self._size + 2**24))
            fields = _LAYOUT.pack(*front, 0, base, extension, self._size, root, 0)[:-4]
            self._head = fields + struct.pack("<I", checksum(fields))

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
        wanted = min(len(target), max(0, self._size - self._place))
        found = self._file.read(wanted).ljust(wanted, b"\0")
        covered = self._head[self._place :][:wanted]
        target[:wanted] = covered + found[len(covered) :]
        self._place += wanted
        return wanted

    def close(self) -> None:
        self._file.close()
        super().close()


def checksum(data: bytes) -> int:
    """Jenkins' lookup3 of a few bytes that are a multiple of 4, as HDF5 uses it."""
    a = b = c = (0xDEADBEEF + len(data)) & _MASK
    words = list(struct.unpack(f"<{len(data) // 4}I", data))
    while len(words) > 3:
        a, b, c = (a + words[0]) & _MASK, (b + words[1]) & _MASK, (c + words[2]) & _MASK
        for turn in (4, 6, 8, 16, 19, 4):
            a = ((a - c) & _MASK) ^ _turned(c, turn)
            c = (c + b) & _MASK
            a, b, c = b, c, a
        words = words[3:]
    a, b, c = ((x + y) & _MASK for x, y in zip((a, b, c), [*words, 0, 0], strict=False))
    for turn in (14, 11, 25, 16, 4, 14, 24):
        c = ((c ^ b) - _turned(b, turn)) & _MASK
        a, b, c = b, c, a
    return b


def _turned(value: int, bits: int) -> int:
    return ((value << bits) | (value >> (32 - bits))) & _MASK


def _head(path: Path) -> tuple[Any, ...] | None:
    with path.open("rb") as file:
        head = file.read(_LAYOUT.size)
    if len(head) < _LAYOUT.size or not head.startswith(_SIGNATURE) or head[8] not in (2, 3):
        return None
    return _LAYOUT.unpack(head)
