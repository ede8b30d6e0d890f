"""The check on an emulated bench: what its safety inputs are, and that each of them ends it."""

import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from bench.analysis.check_line import Verdict
from bench.app.catalogue import load_protocol
from bench.app.session import SessionResult, run_session
from bench.config.model import BenchConfiguration
from bench.config.sections import Acquisition
from bench.datafile.reader import open_datafile
from bench.engine.interface import Requests, Unattended
from bench.results import FILE
from drivers.daqmx.parameters import Daq
from drivers.emulation.control import ask
from drivers.emulation.laboratory import Laboratory
from drivers.hardware.parameters import Hardware
from protocols.check.lines import safety_lines
from protocols.check.protocol import CheckParameters
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBenchParameters

Check = Callable[[], SessionResult]
MENDED = (
    ("release_emergency_stop", []),
    ("reset_over_travel", []),
    ("reset_amplifier", []),
    ("mend_wire", ["over_travel"]),
)


@pytest.fixture(scope="module")
def laboratory() -> Iterator[Laboratory]:
    with Laboratory(VirtualBenchParameters(), Specimen(), seed=1, connection="analogue") as laboratory:
        yield laboratory


@pytest.fixture
def check(laboratory: Laboratory, tmp_path: Path) -> Check:
    configuration = BenchConfiguration(
        backend="hardware", hardware=laboratory.hardware, acquisition=Acquisition(block_duration=0.05, lead=0.4)
    )

    protocol = replace(load_protocol("check"), figures=())

    def run() -> SessionResult:
        return run_session(
            protocol,
            protocol.prepare(CheckParameters(rest=20.0), configuration, None),
            out=tmp_path,
            operator=Unattended(),
            subscribers=(),
            requests=Requests(),
            realtime=True,
        )

    return run


def does(laboratory: Laboratory, fault: str, arguments: list[object]) -> None:
    ask(str(laboratory.hardware.emulator_address), "safety", fault=fault, arguments=arguments)


@pytest.mark.seconds
@pytest.mark.parametrize(
    ("fault", "arguments", "says"),
    [
        ("press_emergency_stop", [], "emergency stop, amplifier ready opened"),
        ("trip_over_travel", [2], "over-travel 2, amplifier ready opened"),
        ("trip_amplifier", [], "amplifier ready opened"),
        ("break_wire", ["over_travel"], "over-travel opened"),
    ],
)
def test_an_input_that_opens_halts_the_bench_and_the_file_says_which(
    laboratory: Laboratory, check: Check, tmp_path: Path, fault: str, arguments: list[object], says: str
) -> None:
    opened: list[float] = []
    over = threading.Event()

    def soon() -> None:
        while not laboratory.bench.enabled:
            if over.wait(0.01):
                return
        time.sleep(0.2)
        does(laboratory, fault, arguments)
        opened.append(time.monotonic())

    thread = threading.Thread(target=soon)
    thread.start()
    try:
        result = check()
        took = time.monotonic() - opened[0]
    finally:
        over.set()
        thread.join()
        truth = ask(str(laboratory.hardware.emulator_address), "truth")
        for mended, which in MENDED:
            does(laboratory, mended, list(which))
    assert (result.status, result.reason) == ("halted", says)
    assert truth["drive"] == 0.0
    assert not truth["enabled"]
    assert not truth["contacts"]["enable relay"]
    with open_datafile(tmp_path / FILE) as record:
        assert record.status == "halted"
        assert says in record.summary
        assert any(event.text == f"armed -> halted: {says}" for event in record.events)
    # the block that is read, and the files that are written after it
    assert took < 5.0


def test_an_open_input_keeps_the_bench_from_being_armed(laboratory: Laboratory, check: Check) -> None:
    does(laboratory, "press_emergency_stop", [])
    try:
        result = check()
    finally:
        does(laboratory, "release_emergency_stop", [])
    assert result.status == "failed"
    assert "arming is refused: emergency stop open" in result.reason
    assert not laboratory.bench.enabled


def test_the_check_says_which_are_read_and_which_are_not() -> None:
    daq = Daq(emergency_stop={"good": "low"}, amplifier_ready={})  # type: ignore[arg-type]
    lines = list(safety_lines(BenchConfiguration(backend="hardware", hardware=Hardware(daq=daq))))
    assert [(line.subject, line.verdict) for line in lines] == [
        ("emergency stop", Verdict.PASSED),
        ("amplifier ready", Verdict.PASSED),
        ("over-travel", Verdict.UNTESTED),
        ("enable line", Verdict.UNTESTED),
    ]
    assert lines[0].what == "Dev1/port0/line1 was low: good"
    assert list(safety_lines(BenchConfiguration())) == []
