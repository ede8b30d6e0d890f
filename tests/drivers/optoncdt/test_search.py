"""Who is on which port, without changing anything there."""

import pytest

from drivers.optoncdt import search
from drivers.optoncdt.port import open_port
from drivers.optoncdt.search import find_lasers
from tests.drivers.optoncdt.peer import Peer, no_thread_left
from tests.drivers.optoncdt.script import INFO, Script, measurements

ASKED: Script = [(b"GETUSERLEVEL", b"GETUSERLEVEL PROFESSIONAL\r\n->"), (b"GETINFO", INFO)]


def test_sensors_are_found_and_asked_nothing_but_who_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivers.optoncdt.search.BAUDS", (921_600, 115_200))
    other: Script = [ASKED[0], (b"GETINFO", INFO.replace(b"1420-200", b"1320-25"))]
    # values that come while it is asked; none is split
    values = b"".join(measurements(range(40), 0))
    stream: Script = [(command, values + answer + values) for command, answer in ASKED]
    with (
        no_thread_left(),
        Peer(ASKED, baud=115_200) as slow,
        Peer(other) as strange,
        Peer(stream) as busy,
        Peer([], baud=38_400) as silent,
        Peer([]) as held,
        open_port("me", held.path, 9600),
    ):
        ports = [slow.path, strange.path, busy.path, silent.path, held.path, "/dev/nothing", slow.path]
        found = find_lasers(ports)
    assert [one.port for one in found] == ports[:-1]
    assert [one.baud for one in found] == [115_200, 921_600, 921_600, None, None, None]
    first, second, third, *rest = found
    assert first.info is not None
    assert (first.info.model, first.problem) == ("ILD1420-200", None)
    assert second.info is not None
    assert second.info.model == "ILD1320-25"
    assert "not an ILD1420" in str(second.problem)
    assert (third.info, third.problem) == (first.info, None)
    for one, text in zip(
        rest, ("no sensor responds", "is in use; close", "there is no port /dev/nothing"), strict=True
    ):
        assert one.info is None
        assert text in str(one.problem)


def test_without_names_the_ports_of_the_system_are_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(search, "listed_ports", list)
    assert find_lasers() == []
    with Peer(ASKED) as peer:
        monkeypatch.setattr(search, "listed_ports", lambda: [peer.path])
        assert [one.port for one in find_lasers()] == [peer.path]
