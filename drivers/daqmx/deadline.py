"""No call to a gRPC device server may last for ever."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import grpc

_SLOW = {"ResetDevice": 10.0}
"""Calls that take their time without saying so [s]."""
_LATE = 0.1
"""What is left of the patience with a server that was late once: what is still tried must not take long."""
_LEAST = 0.1
"""Time that every call gets beyond its own [s]."""


@dataclass(frozen=True)
class CallDetails(grpc.ClientCallDetails):
    """How a call is made: the fields that gRPC asks for."""

    method: str
    timeout: float | None
    metadata: Any
    credentials: Any
    wait_for_ready: bool | None
    compression: Any


class Deadline(grpc.UnaryUnaryClientInterceptor):
    """Gives every call the time it asks for itself, plus `patience` seconds."""

    def __init__(self, patience: float) -> None:
        self._patience = patience
        self.late = False
        """Whether a call was not answered in time: what it was about is unknown since."""

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
