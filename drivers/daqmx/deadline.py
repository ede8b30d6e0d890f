"""Calls to a gRPC device server: their deadlines, and call objects and constant answers shared by all tasks."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import grpc

_SLOW = {"ResetDevice": 10.0}
"""Additional time, by procedure, for slow calls whose requests contain no time-out [s]."""
_LATE = 0.1
"""Fraction of `patience` allowed for calls after a first time-out."""
_LEAST = 0.1
"""Shortest time allowed beyond a call's own time-out [s]."""


@dataclass(frozen=True)
class CallDetails(grpc.ClientCallDetails):
    """Details of a call: the fields that gRPC requires."""

    method: str
    timeout: float | None
    metadata: Any
    credentials: Any
    wait_for_ready: bool | None
    compression: Any


class Deadline(grpc.UnaryUnaryClientInterceptor):
    """Sets the deadline of every call to the call's own time-out plus `patience` [s]; after a first time-out, only a
    tenth of `patience` is allowed.
    """

    def __init__(self, patience: float) -> None:
        self._patience = patience
        self.late = False
        """Whether a call has timed out: its effect is unknown."""

    def intercept_unary_unary(
        self, continuation: Callable[[grpc.ClientCallDetails, Any], Any], client_call_details: Any, request: Any
    ) -> Any:
        given = client_call_details
        details = CallDetails(
            given.method,
            self._seconds(str(given.method).rpartition("/")[2], float(getattr(request, "timeout", 0.0))),
            given.metadata,
            given.credentials,
            given.wait_for_ready,
            given.compression,
        )
        call = continuation(details, request)
        if call.code() is grpc.StatusCode.DEADLINE_EXCEEDED:
            self.late = True
        return call

    def _seconds(self, method: str, own: float) -> float:
        patience = self._patience * (_LATE if self.late else 1.0)
        return max(own, 0.0) + _SLOW.get(method, 0.0) + max(patience, _LEAST)


_CONSTANT = "GetSystemInfoAttributeUInt32"
"""Procedure whose answers do not change while a server runs: nidaqmx asks for the three parts of the driver's version
for every task.
"""


class Remembered:
    """A procedure of the server whose answer to the same request is obtained only once; a failure is not kept."""

    def __init__(self, call: Any) -> None:
        self._call = call
        self._answers: dict[bytes, Any] = {}

    def __call__(self, request: Any, **options: Any) -> Any:
        key = request.SerializeToString()
        if key not in self._answers:
            self._answers[key] = self._call(request, **options)
        return self._answers[key]


class OnDemand:
    """A procedure of the server whose call object is created by `make` at the first call."""

    def __init__(self, make: Callable[[], Any]) -> None:
        self._make = make
        self._call: Any = None

    def __call__(self, request: Any, **options: Any) -> Any:
        if self._call is None:
            self._call = self._make()
        return self._call(request, **options)


class ReusedCalls:
    """A channel that creates the call object of each procedure of the server only once, when it is first used; nidaqmx
    requests the objects of all procedures, about 450, for every task.
    """

    def __init__(self, channel: Any) -> None:
        self._channel = channel
        self._calls: dict[str, Any] = {}

    def unary_unary(self, method: str, *arguments: Any, **options: Any) -> Any:
        """The object that calls `method`; arguments and options are those of gRPC."""
        if method not in self._calls:
            call = OnDemand(partial(self._channel.unary_unary, method, *arguments, **options))
            self._calls[method] = Remembered(call) if method.endswith(f"/{_CONSTANT}") else call
        return self._calls[method]

    def __getattr__(self, name: str) -> Any:
        return getattr(self._channel, name)
