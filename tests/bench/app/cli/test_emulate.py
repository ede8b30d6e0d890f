"""`rockbench emulate`: a laboratory in a process of its own, reached with the configuration that it gives out."""

import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from bench.app.cli.main import main
from bench.config.model import BenchConfiguration
from bench.config.toml import read_configuration
from bench.rigs import open_rig
from bench.testing.conformance import play, started
from drivers.daqmx.devices import find_devices
from tests.patience import LONG

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals, and no SIGTERM")


class Laboratory:
    """`rockbench emulate` as a process."""

    def __init__(self, folder: Path, *flags: str) -> None:
        self.file = folder / "lab.toml"
        self.process = subprocess.Popen(
            [sys.executable, "-m", "bench", "emulate", "--write", str(self.file), *flags],
            stderr=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self.process.stderr is not None
        self.said: list[str] = []
        self._reader = threading.Thread(target=self.said.extend, args=(iter(self.process.stderr.readline, ""),))
        self._reader.start()

    def configuration(self) -> BenchConfiguration:
        """What it gives out, as soon as it serves."""
        deadline = time.monotonic() + LONG
        while not (self.file.exists() and self.file.read_text(encoding="utf-8").endswith("\n")):
            assert self.process.poll() is None, "".join(self.said)
            assert time.monotonic() < deadline, "the laboratory does not start"
            time.sleep(0.02)
        return read_configuration(self.file)

    def end(self, number: int = signal.SIGTERM) -> int:
        """Ask it to end, and wait for its exit code."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        code = self.process.wait(LONG)
        self._reader.join()
        for stream in (self.process.stdout, self.process.stderr):
            assert stream is not None
            stream.close()
        return code


def test_the_configuration_reaches_the_laboratory_and_sigterm_ends_it(tmp_path: Path) -> None:
    given = tmp_path / "given.toml"
    given.write_text("[specimen.frame]\nk2 = 60.0\n[limits]\nvelocity = 0.5\n", encoding="utf-8")
    laboratory = Laboratory(tmp_path, "--config", str(given), "--sample-rate", "1000", "--lead", "0.4")
    try:
        configuration = laboratory.configuration()
        assert configuration.backend == "hardware"
        assert (configuration.specimen.frame.k2, configuration.limits.velocity) == (60.0, 0.5)
        assert configuration.hardware.sample_rate == 1000.0
        assert configuration.acquisition.lead == 0.4
        assert configuration.serves_itself
        names = {device.name for device in find_devices(configuration.hardware.daq.server)}
        assert configuration.hardware.daq.output.split("/")[0] in names
        # the client's own choice: how long it observes the lasers before their clocks count as known
        lasers = configuration.hardware.lasers.model_copy(update={"observation_time": 1.5})
        hardware = configuration.hardware.model_copy(update={"lasers": lasers})
        with open_rig(configuration.model_copy(update={"hardware": hardware}), realtime=True) as rig:
            blocks = play(started(rig), np.zeros(400))
            assert [channel.name for channel in rig.channels][-2:] == ["laser_1", "laser_2"]
            assert blocks[0].counts.shape == (100, 4)
    finally:
        code = laboratory.end()
    assert code == 0
    said = "".join(laboratory.said)
    assert f"rockbench check --config {laboratory.file}" in said
    assert said.rstrip().endswith("the laboratory is closed")


def test_ctrl_c_ends_it_too_and_analogue_lasers_need_no_port(tmp_path: Path) -> None:
    laboratory = Laboratory(tmp_path, "--lasers", "analogue", "--device", "crio", "--clock-error", "1e-5", "0", "-2e-5")
    try:
        # nothing but what was asked for differs from the defaults
        assert laboratory.configuration().acquisition == BenchConfiguration().acquisition
        hardware = laboratory.configuration().hardware
        assert hardware.lasers.connection == "analogue"
        assert hardware.laser_1.port is None
        assert hardware.laser_1.terminal.startswith("cRIO1Mod")
    finally:
        code = laboratory.end(signal.SIGINT)
    assert code == 0


def test_a_chassis_has_the_modules_that_it_was_given(tmp_path: Path) -> None:
    modules = ("9239", "9205", "9263", "9401")
    laboratory = Laboratory(tmp_path, "--device", "cDAQ-9174", "--modules", *modules)
    try:
        hardware = laboratory.configuration().hardware
        products = [device.product for device in find_devices(hardware.daq.server)]
        assert products == ["cDAQ-9174", *(f"NI {module}" for module in modules)]
        terminals = (hardware.table_acceleration.terminal, hardware.table_displacement.terminal)
        assert terminals == ("cDAQ1Mod1/ai1", "cDAQ1Mod2/ai0")
    finally:
        code = laboratory.end()
    assert code == 0


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (("--sample-rate", "30000"), ("--sample-rate", "30000", "20000")),
        (("--sample-rate", "150"), ("cutoff", "half the sample rate")),
        (("--seed", "-1"), ("--seed", "-1")),
        (("--lasers", "wireless"), ("wireless",)),
        (("--lead", "9"), ("--lead", "9")),
        (("--device", "cDAQ-9174", "--modules", "9999"), ("--modules", "9999", "9205")),
        (("--device", "cDAQ-9174", "--modules", "9205", "9401"), ("--modules", "analogue output (9263, 9269)")),
        (("--modules", "9205"), ("--modules", "usb")),
        (("--clock-error", "1e-5"), ("--clock-error",)),
        (("--config", "absent.toml"), ("there is no such file",)),
    ],
)
def test_what_cannot_be_emulated_is_refused(
    flags: tuple[str, ...], words: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["emulate", *flags]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    for word in words:
        assert word in captured.err


def test_a_file_is_never_overwritten_and_hardware_is_not_emulated(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "bench.toml"
    file.write_text('backend = "hardware"\n', encoding="utf-8")
    assert main(["emulate", "--write", str(file)]) == 2
    assert "never overwritten" in capsys.readouterr().err
    assert main(["emulate", "--config", str(file)]) == 2
    assert 'it must be "simulated"' in capsys.readouterr().err
