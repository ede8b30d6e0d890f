"""Locks of the data file on Windows or Wine, without HDF5: run by `tests/windows/run`."""

import ctypes
import importlib
import msvcrt
import os
import sys
import tempfile
import types
from ctypes import wintypes
from pathlib import Path

# HDF5 may not be importable here, and is not needed
stand_in = types.ModuleType("bench.datafile.hdf5_reading")
stand_in.DataFileError = OSError  # type: ignore[attr-defined]
sys.modules["bench.datafile"] = types.ModuleType("bench.datafile")
sys.modules["bench.datafile"].__path__ = [str(Path(__file__).parents[2] / "bench" / "datafile")]
sys.modules["bench.datafile.hdf5_reading"] = stand_in
held = importlib.import_module("bench.datafile.held")


class Overlapped(ctypes.Structure):
    _fields_ = (
        ("internal", ctypes.c_void_p),
        ("internal_high", ctypes.c_void_p),
        ("offset", wintypes.DWORD),
        ("offset_high", wintypes.DWORD),
        ("event", wintypes.HANDLE),
    )


def lock_whole(handle: int) -> bool:
    """Lock a whole file for reading as HDF5 does, at once."""
    kernel = ctypes.WinDLL("kernel32", use_last_error=True)  # type: ignore[attr-defined]
    file = wintypes.HANDLE(msvcrt.get_osfhandle(handle))  # type: ignore[attr-defined]
    return bool(kernel.LockFileEx(file, 1, 0, 0xFFFFFFFF, 0xFFFFFFFF, ctypes.byref(Overlapped())))


def main() -> None:
    path = Path(tempfile.mkdtemp(), "file")
    path.write_bytes(b"x" * 100)
    binary = getattr(os, "O_BINARY", 0)
    writer, reader = os.open(path, os.O_RDWR | binary), os.open(path, os.O_RDONLY | binary)
    print("a reader locks the whole file, no guard:", lock_whole(reader))
    try:
        os.write(writer, b"y")
        print("a write under its lock: carried out (Wine; Windows refuses it)")
    except OSError as error:
        print(f"a write under its lock: errno {error.errno}, recognised {held.is_held(error)}")
    os.close(reader)
    guard, reader = os.open(path, os.O_RDWR | binary), os.open(path, os.O_RDONLY | binary)
    held.keep_lockers_out(guard)
    print("a reader locks the whole file, guarded:", lock_whole(reader))
    os.lseek(writer, 0, os.SEEK_SET)
    print(
        "the writer writes:",
        os.write(writer, b"z") == 1,
        "and a reader without locks reads:",
        os.read(reader, 1) == b"z",
    )
    os.close(guard)
    print("a reader locks the whole file after the end:", lock_whole(reader))


main()
