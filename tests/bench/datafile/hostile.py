"""Hostile data files: a sound one in which one object was replaced by something else, or something was added."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import h5py.h5g
import numpy as np

from bench.datafile.structure import MOST_OBJECTS

Change = Callable[[Any], None]
"""What is done to the open file."""

PATHS = (
    "entry",
    "entry/instrument",
    "entry/metadata",
    "entry/points",
    "entry/events",
    "entry/data",
    "entry/checksums",
    "entry/prediction",
    "entry/instrument/blocks",
    "entry/instrument/laser_1",
    "entry/instrument/drive",
    "entry/complete",
    "entry/status",
    "entry/title",
    "entry/start_time",
    "entry/end_time",
    "entry/summary",
    "entry/program_name",
    "entry/instrument/sample_rate",
    "entry/instrument/drive/voltage",
    "entry/instrument/laser_1/counts",
    "entry/instrument/blocks/row",
    "entry/instrument/blocks/first",
    "entry/instrument/blocks/run",
    "entry/instrument/blocks/time",
    "entry/data/time",
    "entry/events/time",
    "entry/events/kind",
    "entry/metadata/configuration",
    "entry/points/omega_rad_s",
    "entry/points/status",
    "entry/checksums/values",
    "entry/prediction/omega",
)
"""Objects that a reader meets."""
SAMPLES = "entry/instrument/laser_1/counts"


def _group(parent: Any, name: str) -> None:
    parent.create_group(name)


def _claims_terabytes(parent: Any, name: str) -> None:
    parent.create_dataset(name, shape=(2**43,), maxshape=(None,), dtype="i2", chunks=(2**16,))


def _bomb(parent: Any, name: str) -> None:
    made = parent.create_dataset(name, shape=(2**28,), dtype="f8", chunks=(2**22,), compression="gzip")
    packed = __import__("zlib").compress(bytes(2**25), 9)
    for start in range(0, 2**28, 2**22):
        made.id.write_direct_chunk((start,), packed)


def _huge_chunk(parent: Any, name: str) -> None:
    parent.create_dataset(name, shape=(2**29,), dtype="i8", chunks=(2**28,), compression="gzip")


def _virtual(parent: Any, name: str) -> None:
    layout = h5py.VirtualLayout(shape=(100,), dtype="i2")
    layout[:] = h5py.VirtualSource("/etc/passwd", "x", shape=(100,))
    parent.create_virtual_dataset(name, layout)


def _virtual_self(parent: Any, name: str) -> None:
    layout = h5py.VirtualLayout(shape=(100,), dtype="i2")
    layout[:] = h5py.VirtualSource(".", f"{parent.name}/{name}", shape=(100,))
    parent.create_virtual_dataset(name, layout)


def _external_values(parent: Any, name: str) -> None:
    parent.create_dataset(name, shape=(100,), dtype="i1", external=[("/etc/passwd", 0, 100)])


def _committed_type(parent: Any, name: str) -> None:
    parent[name] = np.dtype("f8")


def _cycle(parent: Any, name: str) -> None:
    parent[name] = parent.file.get("entry", parent)


def _external_self(parent: Any, name: str) -> None:
    parent[name] = h5py.ExternalLink(parent.file.filename, "/")


def _values(values: Any, **options: Any) -> Callable[[Any, str], None]:
    def put(parent: Any, name: str) -> None:
        parent.create_dataset(name, data=values, **options)

    return put


def _link(link: Any) -> Callable[[Any, str], None]:
    def put(parent: Any, name: str) -> None:
        parent[name] = link

    return put


def _nothing(parent: Any, name: str) -> None:
    pass


INSTEAD: dict[str, Callable[[Any, str], None]] = {
    "nothing": _nothing,
    "a group": _group,
    "terabytes": _claims_terabytes,
    "a bomb": _bomb,
    "a huge chunk": _huge_chunk,
    "a virtual dataset": _virtual,
    "a virtual dataset of itself": _virtual_self,
    "values in another file": _external_values,
    "a type": _committed_type,
    "the group above": _cycle,
    "a soft link to itself": lambda parent, name: _link(h5py.SoftLink(f"{parent.name}/{name}"))(parent, name),
    "a soft link to the root": _link(h5py.SoftLink("/")),
    "an external link": _link(h5py.ExternalLink("/etc/passwd", "/")),
    "an external link to itself": lambda parent, name: _link(h5py.ExternalLink(parent.file.filename, "/"))(
        parent, name
    ),
    "NaN": _values(np.nan),
    "minus one": _values(-1),
    "a text": _values(np.bytes_(b"\xff\xfe text \x1b[31m")),
    "many texts": _values(np.array([b"a", b"bc"])),
    "texts of any length": _values(["a", "b" * 1000], dtype=h5py.string_dtype()),
    "three axes": _values(np.zeros((2, 2, 2))),
    "infinities": _values(np.full(50, np.inf)),
    "huge integers": _values(np.full(50, 2**62)),
    "records": _values(np.zeros(3, dtype=[("a", "f8"), ("b", "i4")])),
    "no values": _values(h5py.Empty("f8")),
    "nothing of a type": _values(np.zeros(0)),
    "complex numbers": _values(np.zeros(5, dtype=complex)),
    "references": lambda parent, name: _values(
        np.array([parent.file.get("entry", parent).ref] * 2, dtype=object), dtype=h5py.ref_dtype
    )(parent, name),
}


def _many_groups(file: Any) -> None:
    above = file["entry/instrument"].id
    for number in range(MOST_OBJECTS + 1):
        h5py.h5g.create(above, b"channel %d" % number)


def _deep(file: Any) -> None:
    file["entry"].create_group("/".join(["deep"] * 200))


def _json(name: str, text: str) -> Change:
    def put(file: Any) -> None:
        group = file["entry/metadata"]
        if name in group:
            del group[name]
        group.create_dataset(name, data=np.bytes_(text.encode()))

    return put


def _attribute(path: str, name: str, value: Any) -> Change:
    def put(file: Any) -> None:
        file[path].attrs[name] = value

    return put


def _many_attributes(file: Any) -> None:
    for number in range(500):
        file["entry"].attrs[f"attribute {number}"] = number


def _large_attribute(file: Any) -> None:
    file["entry"].attrs.create("large", np.zeros(2**22))


def additions() -> Iterator[tuple[str, Change]]:
    """Kinds that add something."""
    yield "very many channels", _many_groups
    yield "very deep groups", _deep
    yield "very many attributes", _many_attributes
    yield "a large attribute", _large_attribute
    for name in ("configuration", "parameters", "devices", "specimen"):
        for kind, text in {
            "deep": "[" * 5000 + "]" * 5000,
            "deep tables": '{"a":' * 900 + "1" + "}" * 900,
            "no JSON": "{",
            "a number": "1e999",
            "a list": "[1, 2]",
            "null": "null",
            "surrogates": '{"a": "\\ud800"}',
        }.items():
            yield f"metadata {name} {kind}", _json(name, text)
    for name, values in {
        "scale": (0.0, np.nan, np.inf, "text", np.zeros(3)),
        "offset": (np.nan, "text"),
        "valid_range": (np.zeros(3), "text", np.nan),
        "units": (1.0, "", "\x1b[2J", np.zeros(2)),
        "faults": ("[" * 5000, "{", '{"a": "b"}', "[1]", 7),
        "kind": ("text", 5, "\x1b"),
    }.items():
        for number, value in enumerate(values):
            yield f"attribute {name} of a channel, {number}", _attribute(SAMPLES, name, value)
    for number, value in enumerate((0, -1, 99, "2", np.nan, np.zeros(4), "x" * 1000)):
        yield f"format version {number}", _attribute("/", "format_version", value)
        yield f"wording {number}", _attribute("/", "wording", value)
    for number, rate in enumerate((0.0, np.nan, np.inf, -2000.0, 1e-300, 1e300)):

        def put(file: Any, rate: float = rate) -> None:
            file["entry/instrument/sample_rate"][()] = rate

        yield f"sample rate {number}", put
    for number, counts in enumerate((2**62, -5, 0)):

        def count(file: Any, counts: int = counts) -> None:
            file["entry/complete"][...] = counts

        yield f"counted rows {number}", count


@dataclass(frozen=True)
class Kind:
    """A kind of hostile file by name."""

    name: str
    change: Change

    def make(self, sound: Path, path: Path) -> None:
        """Write the hostile file to `path`."""
        path.write_bytes(sound.read_bytes())
        with h5py.File(path, "r+") as file:
            self.change(file)


def kinds() -> list[Kind]:
    """Every kind once."""
    found = [Kind(name, change) for name, change in additions()]
    for path in PATHS:
        for name, instead in INSTEAD.items():

            def put(file: Any, path: str = path, instead: Callable[[Any, str], None] = instead) -> None:
                parent, _, last = path.rpartition("/")
                above = file.require_group(parent or "/")
                if last in above:
                    del above[last]
                instead(above, last)

            found.append(Kind(f"{path}: {name}", put))
    return found
