"""Calls to an emulated device without a network, as to a device on this computer: made in the calling thread."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any, NamedTuple, cast
from unittest.mock import patch

import grpc
from nidaqmx.grpc_session_options import GrpcSessionOptions

from drivers.daqmx.connection import Connection
from drivers.emulation.daqmx.server import Boundary, DaqServer, NiDaqmx


class _Entry(NamedTuple):
    key: str
    value: str


class _Refusal(grpc.RpcError):
    """Error of a call, with what nidaqmx reads from it."""

    def __init__(self) -> None:
        super().__init__()
        self._status: tuple[object, str] = (None, "")
        self._metadata: tuple[_Entry, ...] = ()

    def set_trailing_metadata(self, metadata: tuple[tuple[str, str], ...]) -> None:
        self._metadata = tuple(_Entry(*one) for one in metadata)

    def abort(self, code: object, details: str) -> None:
        self._status = (code, details)
        raise self

    def code(self) -> object:
        return self._status[0]

    def details(self) -> str:
        return self._status[1]

    def trailing_metadata(self) -> tuple[_Entry, ...]:
        return self._metadata


class _Calls:
    """Stands in for a channel of nidaqmx: a call is a call of the server's method, with its planned faults."""

    def __init__(self, daq: DaqServer) -> None:
        hidden: Any = daq
        self._service: Any = NiDaqmx(hidden._driver)  # pyright: ignore[reportAbstractUsage]
        self._boundary = Boundary(hidden._faults)

    def unary_unary(self, method: str, *_: object, **__: object) -> Callable[..., object]:
        handler = cast(Any, grpc).unary_unary_rpc_method_handler(getattr(self._service, method.rpartition("/")[2]))
        call = self._boundary.intercept_service(lambda _: handler, SimpleNamespace(method=method)).unary_unary
        return lambda request, **_: call(request, _Refusal())

    def unary_stream(self, *_: object, **__: object) -> object:
        return None


@contextmanager
def without_network(daq: DaqServer) -> Iterator[None]:
    """Every connection calls `daq` directly. The real drivers run unchanged above nidaqmx; a call takes as
    long as the emulated device needs."""
    calls = _Calls(daq)

    def session(_: Connection, name: str, behavior: Any) -> GrpcSessionOptions:
        return GrpcSessionOptions(cast(Any, calls), name, initialization_behavior=behavior)

    with patch.object(Connection, "_connect", lambda *_, **__: None), patch.object(Connection, "_session", session):
        yield
