"""The second service of the server: what there is, and everything back to the start."""

# ruff: noqa: ARG002 - gRPC gives every call a context, needed or not

import session_pb2 as sessions
from session_pb2_grpc import SessionUtilitiesServicer

from drivers.emulation.daqmx.driver import Driver


class SessionUtilities(SessionUtilitiesServicer):
    """EnumerateDevices, ResetServer."""

    def __init__(self, driver: Driver) -> None:
        self._driver = driver

    def EnumerateDevices(
        self, request: sessions.EnumerateDevicesRequest, context: object
    ) -> sessions.EnumerateDevicesResponse:
        return sessions.EnumerateDevicesResponse(
            devices=[
                sessions.DeviceProperties(
                    name=device.name,
                    model=device.product,
                    vendor="National Instruments",
                    serial_number=f"{device.serial:08X}",
                )
                for device in self._driver.catalogue.devices
            ]
        )

    def ResetServer(self, request: sessions.ResetServerRequest, context: object) -> sessions.ResetServerResponse:
        self._driver.reset()
        return sessions.ResetServerResponse(is_server_reset=True)
