"""An accelerometer by configuration alone: recorded, limited, shown on the run page, exported, replayed."""

from math import tau
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from bench.analysis.signals import SIGNALS, further_of
from bench.app.cli.main import main
from bench.app.gui.window import Window
from bench.app.ipc.broadcast import Reduction
from bench.app.ipc.messages import TRACES, Opened
from bench.config.model import BenchConfiguration
from bench.config.toml import read_configuration
from bench.control.oscillator import DriveCalibration, Segment
from bench.datafile.reader import open_datafile
from bench.engine.interface import Ending
from bench.engine.steps import Arm, Calibrate, Dwell, OperatorAction, Plan, RampOut, Sweep
from bench.events import Acquired, Event, LimitExceeded
from bench.guard.quantities import WatchedQuantities
from bench.rigs import open_rig
from drivers.rig import OperatorTask
from sim.errors import InvalidInput
from sim.parameters import Parameters, quantity
from tests.bench.app.gui.conftest import ScriptedClient
from tests.bench.app.ipc.experiment import order
from tests.recorded import recorded as carried_out

NAME = "storey_2_acceleration"
OMEGA = 15.0
ROW = f"""
[[channels]]
name = "{NAME}"
measures = "acceleration"
unit = "m/s2"
place = "storey 2"
sensitivity = 0.5
zero = 0.1
noise_density = 1e-3
"""


class Point(Parameters):
    """No point is made here."""

    number: int = quantity(0, "1", "a number")


def _configuration(folder: Path, limit: float | None = None) -> BenchConfiguration:
    path = folder / "bench.toml"
    path.write_text(ROW + (f"limit = {limit}\n" if limit else ""), encoding="utf-8")
    return read_configuration(path)


def _run(path: Path, configuration: BenchConfiguration) -> tuple[Ending, list[Event]]:
    """The bare frame under a sine."""
    events: list[Event] = []
    bare = configuration.specimen.bare()

    def plan() -> Plan:
        yield OperatorAction(OperatorTask.REMOVE_BLOCK, bare, "take the block off")
        yield Arm(0.5)
        yield Calibrate(DriveCalibration.flat(1.0))
        yield Sweep((Segment(4.0, 1.5, OMEGA),))
        yield Dwell(12)
        yield RampOut()

    with open_rig(configuration, realtime=False) as rig:  # type: ignore[attr-defined]
        return carried_out(path, plan(), rig, configuration, Point, subscribers=[events.append]), events


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Event]]:
    folder = tmp_path_factory.mktemp("accelerometer")
    ending, events = _run(folder / "campaign.h5", _configuration(folder))
    assert ending.status == "completed", ending.reason
    return folder / "campaign.h5", events


def _amplitude(values: np.ndarray, time: np.ndarray) -> complex:
    """Complex amplitude at OMEGA over whole cycles at the end of the dwell."""
    used = slice(
        int(np.searchsorted(time, time[-1] - 8.0)), int(np.searchsorted(time, time[-1] - 8.0 + 5 * tau / OMEGA))
    )
    wave = np.exp(-1j * OMEGA * time[used])
    return 2.0 * complex(np.mean((values[used] - np.mean(values[used])) * wave))


def test_it_is_recorded_as_the_lasers_saw_the_storey_accelerate(recorded: tuple[Path, list[Event]]) -> None:
    """Under a sine the acceleration is -omega^2 times the displacement, here that of the laser beside the table."""
    with open_datafile(recorded[0]) as record:
        time = record.time()
        laser, measured = record.values("laser_2"), record.values(NAME)
        described = next(channel for channel in record.channels if channel.name == NAME)
        assert (described.quantity, described.unit, described.device) == (
            "acceleration",
            "m/s2",
            "simulated, on storey 2",
        )
    expected, found = -(OMEGA**2) * _amplitude(laser, time), _amplitude(measured, time)
    assert abs(expected) > 1.0, "it moves"
    # the laser's scale and linearity, and its delay of two measurements
    assert abs(found) == pytest.approx(abs(expected), rel=0.01)
    assert abs(np.angle(found / expected)) < 0.03


def test_its_signal_is_published_in_si_units_from_the_zero_at_rest(recorded: tuple[Path, list[Event]]) -> None:
    blocks = [event for event in recorded[1] if isinstance(event, Acquired)]
    rest = np.concatenate([event.signals[:, len(SIGNALS)] for event in blocks[:5]])
    assert abs(rest.mean()) < 1e-3
    assert {event.signals.shape[1] for event in blocks} == {len(SIGNALS) + 1}


def test_its_limit_ends_the_run(tmp_path: Path) -> None:
    ending, events = _run(tmp_path / "campaign.h5", _configuration(tmp_path, limit=1.2))
    assert ending.status == "aborted"
    (over,) = [event for event in events if isinstance(event, LimitExceeded)]
    assert (over.quantity, over.unit, over.limit) == (NAME, "m/s2", 1.2)
    assert over.value > 1.2
    assert ending.cause.subject == NAME


def test_it_is_in_the_matlab_export(recorded: tuple[Path, list[Event]], tmp_path: Path) -> None:
    assert main(["export", str(recorded[0]), "--to", "mat", "--out", str(tmp_path / "out")]) == 0
    files = [loadmat(path, simplify_cells=True) for path in sorted((tmp_path / "out").rglob("*.mat"))]
    (found,) = [values for content in files if (values := _found(content, NAME)).size]
    with open_datafile(recorded[0]) as record:
        np.testing.assert_array_equal(found, record.values(NAME))


def _found(content: object, name: str) -> np.ndarray:
    """The array of this name, wherever the file has it."""
    if isinstance(content, dict):
        if name in content and isinstance(content[name], np.ndarray):
            return content[name]
        for value in content.values():
            if (found := _found(value, name)).size:
                return found
    return np.zeros(0)


def test_it_is_on_the_run_page(
    recorded: tuple[Path, list[Event]], window: Window, spoken: type[ScriptedClient], tmp_path: Path
) -> None:
    window._controller.start(order(tmp_path))
    with open_datafile(recorded[0]) as record:
        channels, rate = record.channels, record.sample_rate
    reduction = Reduction(rate)
    traces = [reduction(event) for event in recorded[1] if isinstance(event, Acquired)]
    opened = Opened(tuple(each.name for each in channels), rate, {}, further_of(channels))
    spoken.latest.said = [opened, *traces]
    window._controller._look()
    shown = window.run.traces
    shown.draw()
    label, unit, _ = shown.labels[-1]
    assert (label, unit, len(shown.plots)) == ("storey 2 acceleration", "m/s²", 6)
    values = shown.curves[-1].getData()[1]
    last = np.concatenate([event.signals[:, len(SIGNALS)] for event in recorded[1] if isinstance(event, Acquired)])
    seconds = round(9.0 * rate)
    assert np.nanmax(values) == pytest.approx(last[-seconds:].max(), rel=0.2)
    assert np.nanmax(values) > 1.0
    # a rig without it shows the five curves of every bench again
    spoken.latest.said = [Opened((), rate, {}, ())]
    window._controller._look()
    assert (len(shown.plots), shown.ring._low.shape[1]) == (5, len(TRACES))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"name": "laser_1"}, r"channels\[0\].name = 'laser_1' .* reserved"),
        ({"name": "Not a name"}, r"channels\[0\].name"),
        ({"place": "elsewhere"}, r"channels\[0\].measures = 'acceleration of elsewhere' .* simulated bench"),
        ({"sensitivity": 0}, r"channels\[0\].sensitivity"),
        ({"limit": -1}, r"channels\[0\].limit = -1"),
    ],
)
def test_a_row_that_cannot_be_is_refused(change: dict[str, object], says: str, tmp_path: Path) -> None:
    path = tmp_path / "bench.toml"
    lines = [line for line in ROW.splitlines() if line.partition(" =")[0] not in change]
    values = [f"{key} = {value!r}".replace("'", '"') for key, value in change.items()]
    path.write_text("\n".join([*lines, *values]), encoding="utf-8")
    with pytest.raises(InvalidInput, match=says):
        read_configuration(path)


def test_a_limit_beyond_what_it_can_measure_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"channels\[0\].limit = 50.0 .* measures only up to 19.8 m/s2"):
        _configuration(tmp_path, limit=50.0)
    # the converter of this bench reaches less far than the sensor
    half = {"simulation": {"bench": {"converter": {"range": 5.0}}}}
    narrow = BenchConfiguration.model_validate(_configuration(tmp_path, limit=15.0).model_dump() | half)
    with pytest.raises(InvalidInput, match=rf"channels.{NAME}.limit = 15.0 .* measures only up to"):
        _run(tmp_path / "campaign.h5", narrow)


def test_a_channel_that_is_called_a_laser_is_no_laser_of_a_storey(tmp_path: Path) -> None:
    """The guard watches the place in the range of the two lasers on the storeys only."""
    path = tmp_path / "bench.toml"
    path.write_text(ROW.replace(NAME, "laser_tilt"), encoding="utf-8")
    configuration = read_configuration(path)
    with open_rig(configuration, realtime=False) as rig:  # type: ignore[attr-defined]
        quantities = WatchedQuantities(rig.channels, rig.sample_rate, 60.0, None)
        values = np.zeros((100, 5))
        values[:, -1] = 19.0
        assert quantities.of(values)["laser_range"].max() < 0.1


def test_a_dry_run_says_that_its_limit_is_not_predicted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    _configuration(tmp_path, limit=12.0)
    asked = [
        "--omega",
        "15",
        "--beta",
        "0.25",
        "--config",
        str(tmp_path / "bench.toml"),
        "--out",
        str(tmp_path / "out"),
    ]
    assert main(["run", "harmonic", *asked, "--dry-run"]) == 0
    said = capsys.readouterr()
    assert f"a run ends if the limit on {NAME} is exceeded" in " ".join((said.out + said.err).split())
