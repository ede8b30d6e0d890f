"""Lies of a rig backend: a rig around a sound one whose answers are false from the opening, or from some block on."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bench.testing.loopback import LoopbackRig
from drivers.rig import Alignment, Block

LATER = 5
"""Blocks read truly before a lie of the run begins."""


class Unanswering(Mapping[str, bool]):
    """Safety inputs that cannot be read."""

    def __getitem__(self, name: str) -> bool:
        raise ZeroDivisionError(name)

    def __iter__(self) -> Any:
        raise ZeroDivisionError("inputs")

    def __len__(self) -> int:
        raise ZeroDivisionError("inputs")


class Truthless:
    """A value without truth."""

    def __bool__(self) -> bool:
        raise ValueError("neither true nor false")


class LyingClock:
    """A clock that answers `said` once `lying`."""

    def __init__(self, inner: Any, said: Any) -> None:
        self._inner, self._said = inner, said
        self.lying = False

    def now(self) -> Any:
        if self.lying:
            return self._said() if callable(self._said) else self._said
        return self._inner.now()

    def wait_until(self, instant: float) -> None:
        self._inner.wait_until(instant)


class LyingRig:
    """The surface of `drivers.rig.Rig`. `answers` replace properties; `change` the blocks, and `raising` the calls,
    after `LATER` blocks.
    """

    def __init__(
        self,
        *,
        answers: Mapping[str, Any] | None = None,
        change: Callable[[Block], Any] | None = None,
        clock: Any = None,
        safety: Callable[[int], Any] | None = None,
        raising: tuple[str, BaseException] | None = None,
    ) -> None:
        self.inner = LoopbackRig()
        self._answers, self._change, self._safety = dict(answers or {}), change, safety
        self._raising = raising
        self.lying_clock = LyingClock(self.inner.clock, clock) if clock is not None else None
        self.blocks = 0
        self.halts = 0

    def __getattr__(self, name: str) -> Any:
        if name in self.__dict__.get("_answers", {}):
            given = self._answers[name]
            if isinstance(given, Exception):
                raise given
            return given
        return getattr(self.inner, name)

    @property
    def clock(self) -> Any:
        if "clock" in self._answers:
            return self._answers["clock"]
        return self.lying_clock or self.inner.clock

    def interlocks(self) -> Any:
        self._raise("interlocks")
        return {"emergency stop": True} if self._safety is None else self._safety(self.blocks)

    def arm(self) -> None:
        self._raise("arm", 0)
        self.inner.arm()

    def write(self, volts: Any) -> None:
        self._raise("write")
        self.inner.write(volts)

    def read(self, n: int) -> Any:
        block = self.inner.read(n)
        self.blocks += 1
        self._raise("read")
        if self.blocks <= LATER:
            return block
        if self.lying_clock is not None:
            self.lying_clock.lying = True
        return block if self._change is None else self._change(block)

    def stop(self) -> None:
        self.inner.stop()
        self._raise("stop", 0)

    def halt(self) -> None:
        self.halts += 1
        self.inner.halt()
        self._raise("halt", 0)

    def close(self) -> None:
        self.inner.close()
        self._raise("close", 0)

    def perform(self, work: Any, amount: float | None = None) -> None:
        self._raise("perform", 0)
        self.inner.perform(work, amount)

    def _raise(self, call: str, later: int = LATER) -> None:
        if self._raising is not None and self._raising[0] == call and self.blocks >= later:
            raise self._raising[1]


@dataclass(frozen=True)
class Lie:
    """A lie by name; `says` is in the reason of the run's end. `opens`: it is refused before anything is armed."""

    name: str
    make: Callable[[], LyingRig]
    says: str
    opens: bool = False


def _first(value: Any) -> Callable[[Block], Any]:
    return lambda block: Block(value, block.counts)


def _counts(change: Callable[[Any], Any]) -> Callable[[Block], Any]:
    return lambda block: Block(block.first, change(block.counts))


def blocks() -> list[Lie]:
    """Blocks that are none."""
    changes: dict[str, tuple[Callable[[Block], Any], str]] = {
        "one column too few": (_counts(lambda c: c[:, :-1]), "shape"),
        "one column too many": (_counts(lambda c: np.hstack((c, c[:, :1]))), "shape"),
        "transposed": (_counts(lambda c: c.T), "shape"),
        "one row": (_counts(lambda c: c[0]), "shape"),
        "three axes": (_counts(lambda c: c[None]), "shape"),
        "scalar": (_counts(lambda c: c[0, :1].reshape(())), "shape"),
        "floats": (_counts(lambda c: c.astype(float)), "float64"),
        "floats with NaN": (_counts(lambda c: np.where(c == c, np.nan, c)), "float64"),
        "complex": (_counts(lambda c: c.astype(complex)), "complex128"),
        "unsigned": (_counts(lambda c: c.astype(np.uint16)), "uint16"),
        "64 bits": (_counts(lambda c: c.astype(np.int64)), "int64"),
        "truth values": (_counts(lambda c: c.astype(bool)), "bool"),
        "texts": (_counts(lambda c: c.astype(str)), "<U"),
        "objects": (_counts(lambda c: c.astype(object)), "object"),
        "the other byte order": (_counts(lambda c: c.astype(">i2")), ">i2"),
        "a list": (_counts(lambda c: c.tolist()), "list"),
        "no counts": (_counts(lambda _c: None), "NoneType"),
        "counts beyond the channel's storage": (_counts(lambda c: c.astype(np.int32) + 70_000), "70"),
        "no rows": (_counts(lambda c: c[:0]), "missing"),
        "too many rows": (_counts(lambda c: np.vstack((c, c))), "missing"),
        "nothing": (lambda _block: None, "NoneType"),
        "a tuple": (lambda block: (block.first, block.counts), "tuple"),
        "first NaN": (_first(float("nan")), "nan"),
        "first infinite": (_first(float("inf")), "inf"),
        "first a fraction": (_first(500.5), "500.5"),
        "first a text": (_first("500"), "'500'"),
        "first None": (_first(None), "None"),
        "first a truth value": (_first(True), "True"),
        "first negative": (_first(-500), "-500"),
        "first huge": (_first(10**30), "missing"),
        "first behind": (_first(0), "missing"),
    }
    return [Lie(f"block: {name}", lambda c=c: LyingRig(change=c), says) for name, (c, says) in changes.items()]


def channels() -> list[Lie]:
    """Channels that no file could hold."""
    sound = LoopbackRig().channels
    fields: list[tuple[str, Any]] = [
        *(("scale", value) for value in (0.0, float("nan"), float("inf"), 1e308, "1", None)),
        *(("offset", value) for value in (float("nan"), float("inf"), None)),
        *(("unit", value) for value in ("m\ud800", "", None, "m\n", "m\x1b[31m")),
        *(("name", value) for value in ("laser\ud800", "", "a/b", "..", None, sound[1].name)),
        *(("valid", value) for value in (None, (5, 5), (9, 1), (0.5, 2), (0, 2**40), (0,))),
        *(("higher", value) for value in ((float("nan"),), None)),
        *(("faults", value) for value in (None, {1.5: "x"}, {-32768: "\ud800"})),
        ("device", "\udfff"),
        ("quantity", None),
    ]
    lies = [
        Lie(
            f"channel: {field} {value!a}",
            lambda f=field, v=value: LyingRig(answers={"channels": (replace(sound[0], **{f: v}), *sound[1:])}),
            "channel",
            opens=True,
        )
        for field, value in fields
    ]
    for name, value in {"None": None, "none": (), "texts": ("laser_1",), "a number": 4}.items():
        lies.append(Lie(f"channels: {name}", lambda v=value: LyingRig(answers={"channels": v}), "channel", opens=True))
    return lies


def numbers() -> list[Lie]:
    """Numbers of the rig that are none, or out of all measure."""
    nan, inf = float("nan"), float("inf")
    asked: dict[str, list[Any]] = {
        "sample_rate": [0.0, -1000.0, nan, inf, 1e12, "1000", None, True, 1000 + 0j],
        "lead": [-1, 10**9, nan, inf, 100.5, "100", None],
        "drive_range": [nan, 0.0, inf, -10.0, 1e6, None, "10"],
        "description": [None, {"a": 1}, {"a": "\ud800"}, "rig", {1: "a"}],
        "clock": [None, 5.0, "noon"],
    }
    return [
        Lie(f"{item}: {value!a}", lambda i=item, v=value: LyingRig(answers={i: v}), item.replace("_", " "), opens=True)
        for item, values in asked.items()
        for value in [*values, ZeroDivisionError(f"no {item}")]
    ]


def safety() -> list[Lie]:
    """Safety inputs without an answer; each counts as open."""
    later: dict[str, Any] = {
        "None": None,
        "renamed": {"EMERGENCY STOP": True},
        "gone": {},
        "a list": ["emergency stop"],
        "a text": {"emergency stop": "yes"},
        "NaN": {"emergency stop": float("nan")},
        "a number": {"emergency stop": 1},
        "without truth": {"emergency stop": Truthless()},
        "an array": {"emergency stop": np.array([True, True])},
        "unreadable": Unanswering(),
    }
    return [
        *(
            Lie(
                f"safety input: {name}",
                lambda v=value: LyingRig(safety=lambda n: v if n > LATER else {"emergency stop": True}),
                "emergency stop",
            )
            for name, value in later.items()
        ),
        Lie("safety inputs: None from the start", lambda: LyingRig(safety=lambda _n: None), "safety inputs"),
        Lie(
            "safety inputs: unreadable from the start",
            lambda: LyingRig(safety=lambda _n: Unanswering()),
            "safety inputs",
        ),
        Lie("safety inputs: a text from the start", lambda: LyingRig(safety=lambda _n: "good"), "safety inputs"),
    ]


def clocks() -> list[Lie]:
    """Clocks that stop telling the time."""

    def breaks() -> float:
        raise OSError("no such clock")

    said = {"NaN": float("nan"), "infinite": float("inf"), "a text": "noon", "broken": breaks, "a truth value": True}
    return [Lie(f"clock: {name}", lambda v=value: LyingRig(clock=v), "clock") for name, value in said.items()]


def calls() -> list[Lie]:
    """Calls that raise what no caller expects."""
    return [
        Lie(f"{call} raises {type(error).__name__}", lambda c=call, e=error: LyingRig(raising=(c, e)), call)
        for call, error in (
            ("read", ZeroDivisionError("division by zero")),
            ("read", StopIteration()),
            ("read", KeyError("samples")),
            ("write", TypeError("volts")),
            ("arm", AttributeError("device")),
            ("interlocks", IndexError("input 3")),
            ("perform", NotImplementedError()),
            ("stop", OSError(5, "Input/output error")),
            ("close", ValueError("closed already")),
        )
    ]


def alignments() -> list[Lie]:
    """Alignments that are none; the run is sound, the alignment unknown."""
    sound = Alignment("laser_1", 0.0, 1.0, 1e-4, 0.0, 100, 0)
    said = {
        "None": None,
        "texts": ("laser_1",),
        "NaN rate": (replace(sound, rate=float("nan")),),
        "an unknown sensor": (replace(sound, sensor="laser_9"),),
        "no number": (replace(sound, values="many"),),  # type: ignore[arg-type]
    }
    return [
        Lie(f"alignments: {name}", lambda v=value: LyingRig(answers={"alignments": v}), "alignment")
        for name, value in said.items()
    ]
