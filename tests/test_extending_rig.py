"""The example of a rig backend of docs/extending.md, in a package of its own beside the project."""

import json
import tomllib
from collections.abc import Generator, Iterator
from importlib import import_module
from math import pi
from pathlib import Path
from types import SimpleNamespace

import pytest
from pytestqt.qtbot import QtBot

from bench.app.catalogue import all_backends, load_protocol
from bench.app.cli.main import main
from bench.config.backend import RIGS, RigSettings, backend_names
from bench.config.model import BenchConfiguration
from bench.config.template import as_toml
from bench.config.toml import problems_of, read_configuration
from bench.datafile.reader import open_datafile
from bench.events import State
from bench.rigs import open_rig
from bench.testing.conformance import RigConformance, RigFactory
from bench.testing.loopback import LoopbackBench, LoopbackRig
from drivers.rig import Rig
from sim.errors import InvalidInput
from tests.installed import PLUGINS, example, installed

TABLE = PLUGINS / "linear_table" / "linear_table.py"
PAGE = Path(__file__).parents[1] / "docs" / "extending.md"
CONFIGURATION = """backend = "linear-table"
[rig]
gain = 2.0
natural_frequency = "500 mHz"
"""
Said = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def plugged(tmp_path_factory: pytest.TempPathFactory) -> Generator[None]:
    """The packages of the example rig and of the example protocol, as an installer leaves them."""
    folder = tmp_path_factory.mktemp("plugins") / "site"
    with example(folder, "linear_table"), example(folder, "tone_sweep"):
        yield


@pytest.fixture
def file(plugged: None, tmp_path: Path) -> Path:  # noqa: ARG001
    path = tmp_path / "bench.toml"
    path.write_text(CONFIGURATION, encoding="utf-8")
    return path


class TestLinearTable(RigConformance):
    @pytest.fixture
    def make_rig(self, plugged: None) -> Iterator[RigFactory]:  # noqa: ARG002
        rigs: list[Rig] = []

        def make() -> Rig:
            rigs.append(open_rig(BenchConfiguration(backend="linear-table"), realtime=False))
            return rigs[-1]

        yield make
        for rig in rigs:
            rig.close()


def test_the_example_is_one_file_of_at_most_100_lines_and_stands_on_the_page() -> None:
    text, page = TABLE.read_text(encoding="utf-8"), PAGE.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 100
    assert f"```python\n{text}```" in page
    assert tomllib.loads((TABLE.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]["entry-points"] == {
        "rockbench.rigs": {"linear-table": "linear_table:BACKEND"}
    }
    assert '[project.entry-points."rockbench.rigs"]\nlinear-table = "linear_table:BACKEND"\n' in page


def test_its_table_is_validated_by_its_own_class_and_survives_a_file(file: Path, tmp_path: Path) -> None:
    configuration = read_configuration(file)
    assert configuration.settings.model_dump()["natural_frequency"] == 0.5
    assert configuration.sample_rate == 1000.0
    # through JSON as a data file keeps it, and through TOML
    assert BenchConfiguration.model_validate_json(configuration.model_dump_json()) == configuration
    copy = tmp_path / "copy.toml"
    copy.write_text(as_toml(configuration), encoding="utf-8")
    assert read_configuration(copy) == configuration
    assert "[simulation]" not in copy.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("gain = -3", "bench.toml: rig.gain = -3 is refused: it must be a number above 0 and at most 100 m/s2/V"),
        ("gian = 3.0", "bench.toml: rig.gian = 3.0 is refused: there is no such key; the nearest is gain"),
        ("half_stroke = -1", "bench.toml: rig.half_stroke = -1 is refused: it must be a number above 0 m"),
    ],
)
def test_what_is_refused_of_it_is_named_with_key_value_and_remedy(file: Path, text: str, said: str) -> None:
    file.write_text(f'backend = "linear-table"\n[rig]\n{text}\n', encoding="utf-8")
    assert said in [str(each) for each in problems_of(file)]


def test_limits_that_could_never_trip_are_refused_by_its_keys(file: Path) -> None:
    file.write_text(f"{CONFIGURATION}half_stroke = 0.05\n[limits]\nacceleration = 60.0\n", encoding="utf-8")
    displacement, acceleration = problems_of(file)
    assert "rig.half_stroke" in str(displacement)
    assert "rig.acceleration_range" in str(acceleration)


def test_a_configuration_to_begin_with_is_written_for_it(plugged: None, tmp_path: Path, capsys: Said) -> None:  # noqa: ARG001
    path = tmp_path / "new.toml"
    assert main(["config", "init", "--backend", "linear-table", str(path)]) == 0
    assert "# acceleration per volt far above the natural frequency [m/s2/V]; a number above 0" in path.read_text()
    assert main(["config", "check", str(path)]) == 0
    assert read_configuration(path).backend == "linear-table"
    assert main(["config", "init", "--backend", "simulated", str(tmp_path / "other.toml")]) == 2
    assert "--backend = 'simulated' is refused" in capsys.readouterr().err


def test_it_is_run_replayed_and_reported(file: Path, tmp_path: Path, capsys: Said) -> None:
    run = ["run", "tone-sweep", "--omega", "10", "40", "--volts", "0.2", "--config", str(file)]
    out = tmp_path / "run"
    assert main([*run, "--dry-run", "--out", str(out)]) == 0
    assert main([*run, "--out", str(out)]) == 0
    gains = {
        point["omega_rad_s"]: point["gain_m_s2_v"]
        for point in json.loads((out / "summary.json").read_text(encoding="utf-8"))["points"]
    }
    for omega, gain in gains.items():
        w = 2.0 * pi * 0.5
        assert gain == pytest.approx(abs(2.0 * omega**2 / complex(w**2 - omega**2, 1.4 * w * omega)), rel=5e-3)
    with open_datafile(out / "campaign.h5") as record:
        assert json.loads(record.metadata["devices"])["backend"] == "linear-table"
        assert json.loads(record.metadata["configuration"])["rig"]["gain"] == 2.0
    capsys.readouterr()
    assert main(["replay", str(out / "campaign.h5")]) == 0
    assert "Bit-identical to the file" in capsys.readouterr().out
    assert main([*run, "--seed", "3", "--out", str(tmp_path / "seed")]) == 2
    assert "--seed = '3' is refused: the backend linear-table has no seed" in capsys.readouterr().err


def test_a_rig_that_adds_the_delays_of_its_inputs_to_the_lead_is_replayed(
    file: Path, tmp_path: Path, capsys: Said, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = import_module("linear_table").LinearTableRig
    monkeypatch.setattr("linear_table.LinearTableRig", lambda settings, lead, clock: made(settings, lead + 7, clock))
    out = tmp_path / "run"
    assert main(["run", "tone-sweep", "--omega", "40", "--config", str(file), "--out", str(out)]) == 0
    with open_datafile(out / "campaign.h5") as record:
        configuration = BenchConfiguration.model_validate_json(record.metadata["configuration"])
        assert int(record.metadata["lead"]) == configuration.lead_samples + 7
    capsys.readouterr()
    assert main(["replay", str(out / "campaign.h5")]) == 0
    assert "Bit-identical to the file" in capsys.readouterr().out


@pytest.mark.usefixtures("plugged")
def test_the_plan_of_a_plug_in_runs_on_a_loop_back_rig() -> None:
    protocol = load_protocol("tone-sweep")
    rig = LoopbackRig()
    bench = LoopbackBench(rig)
    plan = protocol.prepare(protocol.parameters(omega=(40.0,)), BenchConfiguration(), None).plan()
    assert bench.run(plan).status == "completed"
    assert rig.played[-1] == 0.0
    (point,) = bench.engine.returned.points  # type: ignore[union-attr]
    assert point.gain_m_s2_v == pytest.approx(1.0, rel=0.02)
    assert bench.states()[-1] is State.CLOSED


def test_its_table_is_shown_in_the_window(file: Path, qtbot: QtBot) -> None:
    from bench.app.gui.configuration_tree import ConfigurationTree

    tree = ConfigurationTree()
    qtbot.addWidget(tree)
    tree.use(read_configuration(file))
    assert tree.value("rig", "natural_frequency") == "0.5 Hz"
    with pytest.raises(KeyError):
        tree.value("hardware", "sample_rate")


def test_a_backend_that_is_missing_or_fails_to_load_is_named_and_hinders_nothing_else(
    tmp_path: Path, capsys: Said
) -> None:
    folder, path = tmp_path / "site", tmp_path / "bench.toml"
    folder.mkdir()
    (folder / "broken_rig.py").write_text("BACKEND = 1 / 0\n", encoding="utf-8")
    (folder / "no_settings.py").write_text(
        "from bench.config.backend import RigBackend\nfrom sim.parameters import Parameters\n"
        "BACKEND = RigBackend(lambda *_: None, Parameters)\n",
        encoding="utf-8",
    )
    entries = {"broken": "broken_rig:BACKEND", "bare": "no_settings:BACKEND"}
    with installed(folder, "rockbench-broken-rig", {RIGS: entries}):
        assert {"bare", "broken", "hardware", "simulated"} <= set(backend_names())
        found, failed = all_backends()
        assert {"bare", "hardware", "simulated"} <= set(found)
        (line,) = failed
        reason = "broken_rig:BACKEND of rockbench-broken-rig 1.0 cannot be loaded (ZeroDivisionError: division by zero)"
        assert reason in line
        for name, said in (("broken", reason), ("bare", RigSettings.__name__), ("gone", "one of bare, broken")):
            path.write_text(f'backend = "{name}"\n', encoding="utf-8")
            with pytest.raises(InvalidInput) as refused:
                read_configuration(path)
            assert said in str(refused.value)
        assert main(["devices", "--json"]) == 0
        listed = json.loads(capsys.readouterr().out)
        assert listed["backends"] == list(found)
        assert reason in listed["backends_failed"][0]
        path.write_text('backend = "simulated"\n', encoding="utf-8")
        assert main(["config", "check", str(path)]) == 0


def test_a_file_of_a_backend_that_is_gone_says_so(file: Path) -> None:
    from bench.replay.recording import _configuration

    stored = read_configuration(file).model_dump_json().replace("linear-table", "old-table")
    recorded = SimpleNamespace(title="a run", metadata={"configuration": stored})
    with pytest.raises(InvalidInput, match=r"backend = 'old-table' is refused: .*hardware, linear-table, simulated"):
        _configuration(recorded)  # type: ignore[arg-type]
