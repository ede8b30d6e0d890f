"""Calls to a gRPC device server: their deadlines, and call objects and constant answers shared by all tasks."""

from collections.abc import Callable
from functools import partial
from typing import Any, cast

import grpc

_SLOW = {"ResetDevice": 10.0}
"""Additional time, by procedure, for slow calls whose requests contain no time-out [s]."""
_LATE = 0.1
"""Fraction of `patience` allowed for calls after a first time-out."""
_LEAST = 0.1
"""Shortest time allowed beyond a call's own time-out [s]."""


class Deadline:
    """The time allowed for every call: the call's own time-out plus `patience` [s]; after a first time-out, only a
    tenth of `patience` is allowed.
    """

    def __init__(self, patience: float) -> None:
        self._patience = patience
        self.late = False
        """Whether a call has timed out: its effect is unknown."""

    def seconds(self, procedure: str, own: float) -> float:
        """Time allowed for a call of `procedure` with its `own` time-out [s]."""
        patience = self._patience * (_LATE if self.late else 1.0)
        return max(own, 0.0) + _SLOW.get(procedure, 0.0) + max(patience, _LEAST)


class Procedure:
    """A procedure of the server, called within the time that `deadline` allows. `make` creates its call object, at the
    first call.

    An interceptor of gRPC would do the same, but it creates the call object anew for every call.
    """

    def __init__(self, name: str, make: Callable[[], Any], deadline: Deadline) -> None:
        self._name, self._make, self._deadline = name, make, deadline
        self._call: Any = None

    def __call__(self, request: Any, **options: Any) -> Any:
        if self._call is None:
            self._call = self._make()
        options["timeout"] = self._deadline.seconds(self._name, float(getattr(request, "timeout", 0.0)))
        try:
            return self._call(request, **options)
        except grpc.RpcError as error:
            if cast(Any, error).code() is grpc.StatusCode.DEADLINE_EXCEEDED:
                self._deadline.late = True
            raise


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


class ReusedCalls:
    """A channel that creates the call object of each procedure of the server only once, when it is first used; nidaqmx
    requests the objects of all procedures, about 450, for every task.
    """

    def __init__(self, channel: Any, deadline: Deadline) -> None:
        self._channel, self._deadline = channel, deadline
        self._calls: dict[str, Any] = {}

    def unary_unary(self, method: str, *arguments: Any, **options: Any) -> Any:
        """The object that calls `method`; arguments and options are those of gRPC."""
        if method not in self._calls:
            make = partial(self._channel.unary_unary, method, *arguments, **options)
            call = Procedure(method.rpartition("/")[2], make, self._deadline)
            self._calls[method] = Remembered(call) if method.endswith(f"/{_CONSTANT}") else call
        return self._calls[method]

    def __getattr__(self, name: str) -> Any:
        return getattr(self._channel, name)
