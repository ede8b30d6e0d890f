import re
import tomllib
from collections.abc import Callable
from functools import reduce
from pathlib import Path

import pytest

from bench.app.cli.main import main
from bench.config.declared import at, keys
from bench.config.model import BenchConfiguration
from bench.config.review import review
from bench.config.template import as_toml, write_template
from bench.config.toml import Kind, problems_of, read_configuration
from bench.config.validation import problems, validated
from drivers.hardware.parameters import Daq, Hardware, Laser1, Laser2, Lasers, TableForce
from protocols.harmonic.protocol import HarmonicParameters
from sim.errors import InvalidInput
from sim.specimen import Frame, Specimen


@pytest.fixture
def file(tmp_path: Path) -> Callable[[str], Path]:
    """Writes a configuration file and returns its path."""

    def write(text: str) -> Path:
        path = tmp_path / "bench.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def refusal(path: Path) -> str:
    with pytest.raises(InvalidInput) as caught:
        read_configuration(path)
    text = str(caught.value)
    assert "\n" not in text
    return text


def test_a_written_file_reads_back_as_the_defaults(tmp_path: Path):
    path = tmp_path / "rockbench.toml"
    write_template(path)
    assert read_configuration(path) == BenchConfiguration()


def test_a_written_file_holds_every_key_with_unit_and_limits_above_it(tmp_path: Path):
    path = tmp_path / "rockbench.toml"
    write_template(path)
    lines = path.read_text(encoding="utf-8").splitlines()
    names = [
        match[1] for line in lines if (match := re.match(r"#? ?([\w.]+)(?: = |, written by a run|, not to be)", line))
    ]
    assert sorted(name.rpartition(".")[2] for name in names) == sorted(
        key.rpartition(".")[2] for key in keys(BenchConfiguration)
    )
    above = lines[lines.index("k1 = 213.44") - 1]
    assert above == "# stiffness of the first storey [N/m]; a number above 0"


def test_every_line_that_is_uncommented_by_itself_gives_its_key(tmp_path: Path):
    path = tmp_path / "rockbench.toml"
    write_template(path)
    lines = path.read_text(encoding="utf-8").splitlines()
    table, uncommented = "", 0
    for place, line in enumerate(lines):
        if line.startswith("["):
            table = line.strip("[]")
        if not line.startswith("#") or line.startswith("# "):
            continue
        key, _, value = line.removeprefix("#").partition(" = ")
        data = tomllib.loads("\n".join([*lines[:place], line.removeprefix("#"), *lines[place + 1 :]]))
        dotted = f"{table}.{key}" if table else key
        configuration = validated(BenchConfiguration, data)
        found = reduce(getattr, dotted.split("."), configuration)
        assert (list(found) if isinstance(found, tuple) else found) == tomllib.loads(f"x = {value}")["x"], dotted
        assert review(configuration) == review(BenchConfiguration()), dotted
        uncommented += 1
    assert uncommented > 50


@pytest.mark.parametrize("kind", ["minimal", "hardware"])
def test_shorter_files_to_begin_with_are_good_and_never_overwrite(
    kind: Kind, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    path = tmp_path / "rockbench.toml"
    assert main(["config", "init", str(path), f"--{kind}"]) == 0
    written = path.read_text(encoding="utf-8")
    assert main(["config", "check", str(path)]) == 0
    assert capsys.readouterr().err == ""
    configuration = read_configuration(path)
    assert configuration.backend == ("hardware" if kind == "hardware" else "simulated")
    if kind == "minimal":
        assert configuration == BenchConfiguration()
        assert len(written.splitlines()) < 70
    else:
        assert (configuration.hardware.laser_1.port, configuration.hardware.laser_2.port) == ("COM5", "COM6")
        assert configuration.hardware.daq.watchdog == 1.0
        assert "over-travel 2" not in configuration.hardware.daq.missing_inputs
    assert main(["config", "init", str(path), f"--{kind}"]) == 2
    assert path.read_text(encoding="utf-8") == written


def test_a_file_is_never_overwritten(file: Callable[[str], Path]):
    path = file("# mine\n")
    with pytest.raises(InvalidInput, match="never overwritten"):
        write_template(path)
    assert path.read_text(encoding="utf-8") == "# mine\n"


def test_writing_below_a_file_is_refused_in_words(file: Callable[[str], Path]):
    with pytest.raises(InvalidInput, match="cannot be written"):
        write_template(file("") / "rockbench.toml")


def test_values_in_a_file_replace_the_defaults(file: Callable[[str], Path]):
    configuration = read_configuration(file("[specimen.frame]\nk1 = 200\n[simulation]\nseed = 7\n"))
    assert configuration.specimen == Specimen(frame=Frame(k1=200.0))
    assert configuration.simulation.seed == 7


def test_a_byte_order_mark_is_no_error(tmp_path: Path):
    path = tmp_path / "bench.toml"
    path.write_bytes(b"\xef\xbb\xbf[simulation]\r\nseed = 3\r\n")
    assert read_configuration(path).simulation.seed == 3


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[specimen.frame]\nk1 = -213.44", "bench.toml: specimen.frame.k1 = -213.44 is refused: .* above 0 N/m"),
        ("[specimen.frame]\nk1 = nan", "specimen.frame.k1 = nan is refused: it must be a number above 0 N/m"),
        ("[specimen.frame]\nk1 = '200'", "specimen.frame.k1 = '200' is refused: it must be a number"),
        ("[specimen.frame]\nk1 = true", "specimen.frame.k1 = True is refused: it must be a number"),
        ("[specimen.frame]\nk1 = 2024-05-01", "specimen.frame.k1 = '2024-05-01' is refused: it must be a number"),
        ("[specimen.frame]\nxi1 = 1.0", "xi1 = 1.0 is refused: it must be a number at least 0 and below 1$"),
        ("[specimen.frame]\nxi2 = 3.5", "xi2 = 3.5 is refused: it must be .* below 1; 3.5 % is 0.035"),
        (
            "[simulation.bench]\ncatch_angle = 20",
            'catch_angle = 20 is refused: it must be .* below 1 rad; for 20 degrees write "20 deg"',
        ),
        ("[simulation]\nseed = 1_000", "bench.toml: seed = '1_000' is refused: write a decimal number"),
        ("[specimen.frame]\nk1 = 213,44", "not valid TOML.*k1 = 213,44; a decimal comma. write k1 = 213.44"),
        ("[simulation]\nseed = 1.5", "simulation.seed = 1.5 is refused: it must be a whole number"),
        ("[specimen.frame]\nk3 = 1.0", "specimen.frame.k3 = 1.0 is refused: .* nearest is specimen.frame.k[12]"),
        ("[frame]\nk1 = 1.0", "frame = 'a table' is refused: there is no such key"),
        ("k_c = 3.0", "k_c = 3.0 is refused: there is no such key"),
        ("[limits]\nzzz = 0.1", "limits.zzz = 0.1 .* the valid keys here are drive_voltage, drive_slew"),
        ("[specimen]\nhalf_stroke = 0.1", "the nearest is simulation.bench.shaker.half_stroke"),
        ("limits = 3", "limits = 3 is refused: it must be a table of keys"),
        ("backend = 'cdaq'", "backend = 'cdaq' is refused: one of hardware, simulated"),
        ("backend = 3", "backend = 3 is refused: it must be a text"),
        ("[rig]\nsample_rate = 1000.0", r"rig = .* is refused: .* \[simulation\]; remove \[rig\]"),
        (
            "[simulation.bench.filter_unit]\ncutoff = 4e3",
            "simulation.bench.filter_unit.cutoff = 4000.0 .* half the sample rate",
        ),
        (
            "[limits]\nvelocity = 0\n[ramps]\nstop = 0",
            r"limits.velocity = 0 .* \(also refused: bench.toml: ramps.stop\)",
        ),
        ("backend = 'simulated'\n[specimen\n", "not valid TOML: .*line 2"),
    ],
)
def test_what_is_wrong_is_said_in_one_line_with_key_value_and_what_is_allowed(
    file: Callable[[str], Path], text: str, said: str
):
    assert re.search(said, refusal(file(text)))


def test_all_problems_of_a_file_are_listed(file: Callable[[str], Path]):
    found = problems_of(file("[limits]\nvelocity = 0\ndisplacement = -1.0\nspeed = 3\n"))
    assert [problem.item.rpartition(".")[2] for problem in found] == ["displacement", "velocity", "speed"]
    assert problems_of(file("")) == []


def test_files_that_cannot_be_read_are_refused_in_words(tmp_path: Path):
    assert "there is no such file" in refusal(tmp_path / "absent.toml")
    assert "cannot be read" in refusal(tmp_path)
    (tmp_path / "latin.toml").write_bytes(b"# \xe9\n")
    assert "not UTF-8" in refusal(tmp_path / "latin.toml")


def test_an_element_of_a_list_is_judged_by_itself():
    found = problems(HarmonicParameters, {"omega": [12.5, 99.0]})
    assert [str(problem) for problem in found] == [
        "omega[1] = 99.0 is refused: it must be a number above 0 and at most 40 rad/s"
    ]
    assert validated(HarmonicParameters, {"omega": [12, 15.5]}).omega == (12.0, 15.5)


def test_the_words_for_what_a_value_may_be_come_from_its_declaration():
    omega, starts = at(HarmonicParameters, ("omega",)), at(HarmonicParameters, ("starts",))
    assert omega is not None
    assert omega.allowed_in_unit == "one or more numbers, each above 0 and at most 40 rad/s"
    assert starts is not None
    assert starts.allowed == "a whole number at least 1 and at most 32"
    assert at(HarmonicParameters, ("omega", "x")) is None


LABORATORY = """
backend = "hardware"
[hardware]
sample_rate = 5000
[hardware.daq]
server = "crio.local:31763"
watchdog = 1.0
[hardware.table_force]
terminal = "cRIO1Mod1/ai2"
[hardware.lasers]
delay = 0.0035
[hardware.laser_1]
port = "COM5"
polarity = -1
[hardware.laser_2]
port = "COM6"
"""


def test_the_laboratory_is_described_by_its_tables(file: Callable[[str], Path]):
    configuration = read_configuration(file(LABORATORY))
    assert configuration.hardware == Hardware(
        sample_rate=5000.0,
        daq=Daq(server="crio.local:31763", watchdog=1.0),
        table_force=TableForce(terminal="cRIO1Mod1/ai2"),
        lasers=Lasers(delay=0.0035),
        laser_1=Laser1(port="COM5", polarity=-1),
        laser_2=Laser2(port="COM6"),
    )
    assert (configuration.sample_rate, configuration.seed) == (5000.0, None)
    assert not configuration.serves_itself


def test_a_simulated_bench_keeps_its_own_rate_and_seed_beside_the_hardware(file: Callable[[str], Path]):
    configuration = read_configuration(file(LABORATORY.replace('"hardware"', '"simulated"')))
    assert (configuration.sample_rate, configuration.seed) == (2000.0, 1)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[hardware]\nsample_rate = 30000", "hardware.sample_rate = 30000 .* at most 20000"),
        ("[hardware.laser_1]\nport = 'COM5'\n[hardware.laser_2]\nport = 'COM5'", "laser_1 already uses this port"),
        ("[hardware.table_acceleration]\nterminal = 'dev1/AI0'", "table_displacement already uses this terminal"),
        ("[hardware.table_acceleration]\nterminal = '/Dev1/ai0'", "table_displacement already uses this terminal"),
        ("[hardware.lasers]\nconnection = 'usb'", 'hardware.lasers.connection = \'usb\' .* "serial" or "analogue"'),
        ("[hardware.lasers]\ndelay = 0.2", "hardware.lasers.delay = 0.2 .* at most 0.1 s"),
        ("[hardware.laser_1]\npolarity = 2", "hardware.laser_1.polarity = 2"),
        ("[hardware.daq]\nwatch_dog = 1.0", "hardware.daq.watch_dog = 1.0 .* nearest is hardware.daq.watchdog"),
    ],
)
def test_what_is_wrong_with_the_laboratory_is_said(file: Callable[[str], Path], text: str, said: str):
    assert re.search(said, refusal(file(text)))


@pytest.mark.parametrize("text", ["", LABORATORY, "[simulation]\nseed = 7\n[simulation.specimen.frame]\nk2 = 57.5\n"])
def test_a_configuration_as_text_reads_back_as_the_same(file: Callable[[str], Path], text: str):
    configuration = read_configuration(file(text))
    assert read_configuration(file(as_toml(configuration))) == configuration


@pytest.mark.parametrize(
    ("text", "named"),
    [
        (
            "[acquisition]\nblock_duration = 0.2\n[hardware.daq]\nwatchdog = 0.5",
            r"hardware\.daq\.watchdog = 0\.5 .* 3 blocks",
        ),
        ("[acquisition]\nblock_duration = 0.01", r"acquisition\.block_duration = 0\.01 .* analogue"),
    ],
)
def test_blocks_suit_the_devices(tmp_path: Path, text: str, named: str) -> None:
    file = tmp_path / "bench.toml"
    file.write_text(text)
    read_configuration(file)
    file.write_text(f'backend = "hardware"\n{text}')
    with pytest.raises(InvalidInput, match=named):
        read_configuration(file)


FORMER = """
backend = "hardware"
[hardware]
hands = "localhost:31700"
[hardware.daq]
patience = "1500 ms"
[hardware.lasers]
listening = 2.0
[simulation.bench.laser_1]
linearity_waves = 1.0
"""


def test_keys_with_their_former_names_are_accepted_with_a_notice_that_names_the_present_one(
    file: Callable[[str], Path], capsys: pytest.CaptureFixture[str]
):
    path = file(FORMER)
    read = read_configuration(path)
    assert read.hardware.emulator_address == "localhost:31700"
    assert read.hardware.daq.timeout_margin == 1.5
    assert read.hardware.lasers.observation_time == 2.0
    assert read.simulation.bench.laser_1.linearity_periods == 1.0
    assert main(["config", "check", str(path)]) == 0
    said = capsys.readouterr().err
    for old, new in (
        ("hardware.hands", "hardware.emulator_address"),
        ("hardware.daq.patience", "hardware.daq.timeout_margin"),
        ("hardware.lasers.listening", "hardware.lasers.observation_time"),
        ("simulation.bench.laser_1.linearity_waves", "simulation.bench.laser_1.linearity_periods"),
    ):
        assert f"bench.toml: {old} is now called {new}" in said


def test_a_key_with_both_names_is_refused(file: Callable[[str], Path]):
    text = refusal(file('[hardware]\nhands = "a:1"\nemulator_address = "b:1"\n'))
    assert "hardware.hands" in text
    assert "there is no such key" in text


def test_a_refused_value_of_a_former_name_is_named_as_it_is_called_now(file: Callable[[str], Path]):
    assert "hardware.daq.timeout_margin = 0" in refusal(file("[hardware.daq]\npatience = 0.0\n"))


def test_a_profile_sets_block_and_lead_and_is_refused_where_the_devices_are_too_slow():
    from bench.app.cli.inputs import with_profile

    here = BenchConfiguration(backend="hardware", hardware=Hardware(lasers=Lasers(connection="analogue")))
    networked = here.model_copy(
        update={"hardware": here.hardware.model_copy(update={"daq": Daq(server="crio.local:31763")})}
    )
    assert with_profile(here, None) is here
    for configuration, profile, block, lead in (
        (here, "fast", 0.005, 0.01),
        (networked, "fast", 0.01, 0.02),
        (here, "steady", 0.1, 0.1),
    ):
        found = with_profile(configuration, profile).acquisition
        assert (found.block_duration, found.lead) == (block, lead)
    with pytest.raises(InvalidInput, match=r"--profile fast.*acquisition\.block_duration.*analogue lasers"):
        with_profile(BenchConfiguration(backend="hardware"), "fast")


def test_certificates_are_relative_to_the_configuration_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder, elsewhere = tmp_path / "laboratory", tmp_path / "elsewhere"
    folder.mkdir()
    elsewhere.mkdir()
    file, other = folder / "bench.toml", tmp_path / "key.pem"
    lines = ["[hardware.daq.tls]", 'root_certificate = "server.pem"', 'client_certificate = "../client.pem"']
    file.write_text("\n".join([*lines, f"client_key = '{other}'"]), encoding="utf-8")
    monkeypatch.chdir(elsewhere)
    tls = read_configuration(file).hardware.daq.tls
    assert tls is not None
    assert Path(tls.root_certificate) == folder / "server.pem"
    assert Path(str(tls.client_certificate)).resolve() == tmp_path / "client.pem"
    assert Path(str(tls.client_key)) == other


def test_a_table_model_is_relative_to_the_configuration_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "bench"
    folder.mkdir()
    (folder / "bench.toml").write_text('table_model = "table/model.json"\n', encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    read = read_configuration(Path("bench/bench.toml"))
    assert read.table_model == str(folder / "table" / "model.json")
