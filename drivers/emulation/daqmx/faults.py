"""Faults on request, and errors put on the wire."""

import threading
import time
from collections import deque
from typing import Any, cast

import grpc
from nidaqmx.error_codes import DAQmxErrors

from drivers.emulation.daqmx.errors import DaqmxFailure, NotEmulated, SessionExists, SessionMissing

_GRPC = cast(Any, grpc)


class Faults:
    """What shall go wrong next."""

    def __init__(self) -> None:
        self._codes: dict[str, deque[int]] = {}
        self._changed = threading.Condition()
        self._silent_until = 0.0

    def fail_next(self, call: str, code: int) -> None:
        """The next call of this name fails with a code of DAQmx, and is not done; as often as this was asked for."""
        with self._changed:
            self._codes.setdefault(call, deque()).append(code)

    def stall(self, seconds: float) -> None:
        """Answer nobody for so long; what was asked is done then."""
        with self._changed:
            self._silent_until = time.monotonic() + seconds

    def end(self) -> None:
        """Answer from now on."""
        with self._changed:
            self._silent_until = 0.0
            self._changed.notify_all()

    def strike(self, call: str) -> None:
        """Do to a call what was asked for: hold it up, raise DaqmxFailure, or nothing."""
        with self._changed:
            while (remaining := self._silent_until - time.monotonic()) > 0.0:
                self._changed.wait(remaining)
            if waiting := self._codes.get(call):
                code = waiting.popleft()
                raise DaqmxFailure(DAQmxErrors(code), f"A failure was asked for: {DAQmxErrors(code).name}")


class Boundary(_GRPC.ServerInterceptor):
    """Stands around every call: faults go in, errors go out as NI's server sends them.

    A DAQmx error is gRPC status UNKNOWN with its code in the trailing metadata (NI gRPC device server,
    source/server/converters.h).
    """

    def __init__(self, faults: Faults) -> None:
        self._faults = faults

    def intercept_service(self, continuation: Any, handler_call_details: Any) -> Any:
        handler = continuation(handler_call_details)
        if handler is None or handler.unary_unary is None:
            return handler
        name = str(handler_call_details.method).rpartition("/")[2]

        def call(request: object, context: Any) -> object:
            try:
                self._faults.strike(name)
                return handler.unary_unary(request, context)
            except DaqmxFailure as failure:
                context.set_trailing_metadata(_metadata(name, failure))
                context.abort(_GRPC.StatusCode.UNKNOWN, str(failure))
            except SessionExists as error:
                context.abort(
                    _GRPC.StatusCode.ALREADY_EXISTS, f"Cannot initialize '{error}' when a session already exists."
                )
            except SessionMissing as error:
                context.abort(
                    _GRPC.StatusCode.FAILED_PRECONDITION,
                    f"Cannot attach to '{error}' because it has not been initialized.",
                )
            except NotEmulated as error:
                context.abort(_GRPC.StatusCode.UNIMPLEMENTED, f"{error} is not emulated")
            except NotImplementedError:
                context.abort(_GRPC.StatusCode.UNIMPLEMENTED, f"{name} is not emulated")

        return _GRPC.unary_unary_rpc_method_handler(call, handler.request_deserializer, handler.response_serializer)


def _metadata(call: str, failure: DaqmxFailure) -> tuple[tuple[str, str], ...]:
    """The code, and for reads and writes the number of samples per channel before it."""
    entries = [("ni-error", str(failure.code.value))]
    if call.startswith("Read"):
        # what a read that fails has taken is lost: only a time-out gives what it has, as an answer
        entries.append(("ni-samps-per-chan-read", "0"))
    if call.startswith("Write"):
        entries.append(("ni-samps-per-chan-written", str(failure.samples_written)))
    return tuple(entries)
