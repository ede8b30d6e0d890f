"""Validation of everything that a rig backend returns to the bench.

A backend may be part of another package. An invalid rig, channel or block, or an exception that a rig must not raise,
causes a BackendFault, which names the backend. An invalid state of a safety input counts as open.
"""

from collections.abc import Mapping
from contextlib import suppress
from typing import Any, NoReturn, Self, cast

import numpy as np
from numpy.typing import NDArray

from drivers.border_values import RAW, is_alignment, is_count, is_good, is_number, is_raw, is_text, wrong_with
from drivers.clock import Clock, VirtualClock, WallClock
from drivers.errors import BackendFault
from drivers.rig import Alignment, Block, Channel, OperatorTask, RawValues, Rig
from sim.errors import RockbenchError

MOST_CHANNELS = 256
LOWEST_RATE = 1.0
"""Smallest accepted sample rate [1/s]."""
HIGHEST_RATE = 1e6
"""Largest accepted sample rate [1/s]."""
LONGEST_LEAD = 10.0
"""Longest accepted lead [s], the delay from writing a drive sample to its output."""
HIGHEST_VOLTAGE = 100.0
"""Largest accepted drive range [V]."""


class CheckedClock:
    """Clock of a backend, with its readings validated. In place of an invalid reading, `now` returns the last valid
    one, and `fault` describes the invalid one.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._last = 0.0
        self.fault = ""

    def now(self) -> float:
        try:
            given: object = self._clock.now()
        except Exception as error:
            self.fault = f"its clock cannot be read ({_error_text(error)})"
            return self._last
        if is_number(given):
            self._last = float(given)
        else:
            self.fault = f"its clock returned {given!r}"
        return self._last

    def wait_until(self, instant: float) -> None:
        self._clock.wait_until(instant)


class _CheckedVirtualClock(CheckedClock, VirtualClock):
    """Virtual clock of a backend, with its readings validated."""


class CheckedRig:
    """A `drivers.rig.Rig` that validates the rig of the backend `backend`.

    The description of the rig is read once, on construction. Blocks are copied. A safety input counts as open if it
    disappears or is not a Boolean. Raises BackendFault for an invalid rig, after closing the backend's rig.
    """

    def __init__(self, rig: Rig, backend: str) -> None:
        self._rig, self.backend = rig, backend
        # every safety input reported so far, in order; open unless reported good. A stopped rig may omit an input that
        # it reports only while armed, such as that of an amplifier that is ready only while enabled
        self._inputs: dict[str, bool] = {}
        self._while_armed: dict[str, bool] = {}
        self._armed = False
        try:
            self._describe()
        except BaseException:
            with suppress(Exception):
                rig.close()
            raise

    def _describe(self) -> None:
        missing = [name for name in _CALLS if not callable(getattr(self._rig, name, None))]
        if missing:
            self._refuse(f"returned {type(self._rig).__name__}, which is not a rig: it has no {', '.join(missing)}")
        self.channels = self._checked_channels(self._given("channels"))
        self.sample_rate = self._number("sample_rate", HIGHEST_RATE, LOWEST_RATE)
        self.drive_range = self._number("drive_range", HIGHEST_VOLTAGE)
        self.lead = self._checked_lead(self._given("lead"), self.sample_rate)
        self.description = self._checked_description(self._given("description"))
        self.clock = self._checked_clock(self._given("clock"))
        self._require_clock()

    def _given(self, name: str) -> Any:
        """Property `name` of the backend's rig, not yet validated."""
        with self._calls(name.replace("_", " ")):
            return getattr(self._rig, name)

    @property
    def alignments(self) -> tuple[Alignment, ...]:
        """Clock alignments, since `arm()`, of the sensors that have their own clocks."""
        given = self._given("alignments")
        names = [channel.name for channel in self.channels]
        if type(given) is not tuple or not all(is_alignment(each, names) for each in cast("tuple[Any, ...]", given)):
            self._refuse(f"returned alignments {given!a:.80}: they must be a tuple of valid Alignments of its channels")
        return cast("tuple[Alignment, ...]", given)

    def interlocks(self) -> Mapping[str, bool]:
        """Safety inputs by name; False for an input that has disappeared or is not a Boolean."""
        with self._calls("interlocks"):
            given: Any = self._rig.interlocks()
        found: dict[str, bool] | None = None
        if isinstance(given, Mapping):
            with suppress(Exception):
                found = {str(name): is_good(good) for name, good in cast("Mapping[Any, Any]", given).items()}
        if found is None:
            return self._inputs | self._while_armed or {f"safety inputs of the backend {self.backend}": False}
        named = self._while_armed if self._armed else self._inputs
        named |= dict.fromkeys(found, False)
        return self._inputs | self._while_armed | found

    def arm(self) -> None:
        """See `drivers.rig.Rig`, also for the methods below."""
        with self._calls("arm"):
            self._require_clock()
            self._armed = True
            self._rig.arm()

    def write(self, volts: NDArray[np.float64]) -> None:
        with self._calls("write"):
            # pass a copy, because a backend may modify its argument in place
            self._rig.write(np.array(volts, dtype=np.float64))

    def read(self, n: int) -> Block:
        with self._calls("read"):
            given: object = self._rig.read(n)
            self._require_clock()
            return self._checked_block(given)

    def stop(self) -> None:
        self._disarmed()
        with self._calls("stop"):
            self._rig.stop()

    def halt(self) -> None:
        self._disarmed()
        with self._calls("halt"):
            self._rig.halt()

    def _disarmed(self) -> None:
        self._armed, self._while_armed = False, {}

    def close(self) -> None:
        with self._calls("close"):
            self._rig.close()

    def perform(self, work: OperatorTask, amount: float | None = None) -> None:
        with self._calls("perform"):
            self._rig.perform(work, amount)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _calls(self, call: str) -> "_Calls":
        return _Calls(self.backend, call)

    def _refuse(self, what: str) -> NoReturn:
        raise BackendFault(self.backend, what)

    def _require_clock(self) -> None:
        clock = self.clock
        if isinstance(clock, CheckedClock):
            clock.now()
            if clock.fault:
                raise BackendFault(self.backend, f"provides no time: {clock.fault}")

    def _number(self, name: str, highest: float, lowest: float = 0.0) -> float:
        value, item = self._given(name), name.replace("_", " ")
        if not is_number(value) or not (lowest <= value <= highest and value > 0.0):
            least = f"at least {lowest:g}" if lowest else "above 0"
            self._refuse(f"has a {item} of {value!a}: it must be a number {least} and at most {highest:g}")
        return float(value)

    def _checked_lead(self, lead: object, rate: float) -> int:
        most = int(LONGEST_LEAD * rate)
        if not is_count(lead) or not 0 <= lead <= most:
            self._refuse(f"has a lead of {lead!a} samples: it must be an integer from 0 to {most}")
        return int(lead)

    def _checked_channels(self, given: Any) -> tuple[Channel, ...]:
        if type(given) is not tuple or not 0 < len(cast("tuple[Any, ...]", given)) <= MOST_CHANNELS:
            self._refuse(f"has channels {given!a:.80}: they must be a tuple of 1 to {MOST_CHANNELS} channels")
        channels = cast("tuple[Channel, ...]", given)
        known: set[str] = set()
        for number, channel in enumerate(channels):
            with self._calls("channels"):
                wrong = wrong_with(channel) or ("its name is repeated" if channel.name in known else "")
            if wrong:
                self._refuse(f"has an invalid channel at index {number}: {wrong}")
            known.add(channel.name)
        return channels

    def _checked_description(self, given: Any) -> dict[str, str]:
        pairs = cast("Mapping[Any, Any]", given).items() if isinstance(given, Mapping) else [(None, None)]
        if not all(is_text(text) for pair in pairs for text in pair):
            self._refuse(f"has a description {given!a:.80}: it must map strings to strings")
        return dict(pairs)

    def _checked_clock(self, clock: Any) -> Clock:
        # this program's clocks need no check
        if type(clock) in (VirtualClock, WallClock):
            return clock
        if not callable(getattr(clock, "now", None)) or not callable(getattr(clock, "wait_until", None)):
            self._refuse(f"has an invalid clock: {type(clock).__name__}")
        return _CheckedVirtualClock(clock) if isinstance(clock, VirtualClock) else CheckedClock(clock)

    def _checked_block(self, given: Any) -> Block:
        if not isinstance(given, Block):
            self._refuse(f"returned {type(given).__name__} instead of a block")
        first: object = given.first
        counts: Any = given.counts
        if not is_count(first) or first < 0:
            self._refuse(f"returned a block whose first index is {first!a}: it must be an integer, 0 or more")
        if not isinstance(counts, np.ndarray):
            self._refuse(f"returned a block of {type(counts).__name__} instead of an array of counts")
        counts = cast("NDArray[Any]", counts)
        if counts.dtype not in (np.dtype(np.int16), np.dtype(np.int32)):
            self._refuse(f"returned a block of {counts.dtype} instead of int16 or int32")
        if counts.ndim != 2 or counts.shape[1] != len(self.channels):
            self._refuse(f"returned a block of shape {counts.shape} for {len(self.channels)} channels")
        own = np.array(counts, order="K", subok=False)
        if own.dtype != np.int16 and len(own):
            self._require_storable(own)
        return Block(int(first), own)

    def raw_values(self) -> tuple[RawValues, ...]:
        """See `drivers.rig.Rig`; empty for a backend without this method."""
        if not callable(method := getattr(self._rig, "raw_values", None)):
            return ()
        with self._calls("raw values"):
            given: Any = method()
        if given is _NONE:
            return ()
        names = [channel.name for channel in self.channels]
        if type(given) is not tuple or not all(is_raw(each, names) for each in cast("tuple[Any, ...]", given)):
            self._refuse(f"returned raw values {given!a:.80}: they must be a tuple of valid RawValues of its channels")
        raw = cast("tuple[RawValues, ...]", given)
        return tuple(RawValues(each.sensor, *(np.array(getattr(each, name)) for name in RAW)) for each in raw)

    def _require_storable(self, counts: NDArray[Any]) -> None:
        """Refuse counts outside the range of their channel's storage type: storing them would alter them."""
        low, high = counts.min(axis=0), counts.max(axis=0)
        for column, channel in enumerate(self.channels):
            span = np.iinfo(channel.storage)
            if low[column] < span.min or high[column] > span.max:
                found = f"from {low[column]} to {high[column]} of {channel.name}, which are stored in {span.bits} bits"
                self._refuse(f"returned counts {found}")


_NONE: tuple[()] = ()
"""Usual result of `raw_values`; recognised by identity, since a backend may return any type."""


class _Calls:
    """Context manager that converts exceptions that a rig must not raise into BackendFault.

    Implemented as a class, because every block enters several of these, and a generator would take several times as
    long.
    """

    __slots__ = ("_backend", "_call")

    def __init__(self, backend: str, call: str) -> None:
        self._backend, self._call = backend, call

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if isinstance(error, Exception) and not isinstance(error, RockbenchError | MemoryError):
            raise BackendFault(self._backend, f"failed in {self._call} ({_error_text(error)})") from error


_CALLS = ("interlocks", "arm", "write", "read", "stop", "halt", "close", "perform")


def _error_text(error: BaseException) -> str:
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
