"""The optoNCDT lasers on their serial lines, as tracks."""

from contextlib import ExitStack

from drivers.hardware.channels import serial_laser
from drivers.hardware.parameters import Hardware, LaserInput, Lasers
from drivers.hardware.tracks import Track
from drivers.optoncdt.codec import MID_RANGE
from drivers.optoncdt.faults import LOST, MEANINGS, marked
from drivers.optoncdt.sensor import SerialLaser
from drivers.timebase.sensor_track import SensorTrack
from sim.errors import InvalidInput


def open_serial_lasers(hardware: Hardware) -> tuple[Track, ...]:
    """The lasers that are read serially, open; none when they are not. Their closing is the caller's.

    Raises InvalidInput for a laser without port, RigError when one is not there or not as configured; none is left
    open then.
    """
    with ExitStack() as opened:
        tracks: list[Track] = []
        for name, given in hardware.serial_lasers:
            track = _open(name, given, hardware.lasers)
            opened.callback(track.sensor.close)
            tracks.append(track)
        opened.pop_all()
    return tuple(tracks)


def _open(name: str, given: LaserInput, lasers: Lasers) -> Track:
    if given.port is None:
        allowed = "give the serial port of the laser (`rockbench devices` lists them), or lasers.connection"
        raise InvalidInput(f"hardware.{name}.port", given.port, allowed)
    reach = given.measuring_range
    sensor = SerialLaser(name, given.port, baud=given.baud, rate=lasers.rate, measuring_range=reach)
    return Track(
        sensor=sensor,
        channel=serial_laser(name, reach, given.polarity, sensor.description, MEANINGS),
        placing=SensorTrack(name, lasers.rate, lasers.delay, marked, MID_RANGE, LOST),
        listening=lasers.listening,
    )
