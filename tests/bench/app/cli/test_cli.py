import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from io import StringIO
from pathlib import Path

import pytest

from bench.app.cli.interrupt import interruptible
from bench.app.cli.main import main
from bench.app.cli.terminal import AtTheConsole, choose
from bench.app.folders import check_folder
from bench.config.model import BenchConfiguration
from bench.datafile.opening import columns_from
from bench.engine.interface import Requests, Unattended
from bench.events import OperatorAnswered
from drivers.rig import RigError
from protocols.harmonic.protocol import HarmonicParameters
from sim.errors import InvalidInput, RockbenchError
from tests.command_line import FakeSession, main_with


@pytest.fixture
def session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> FakeSession:
    monkeypatch.chdir(tmp_path)
    return FakeSession()


def harmonic(session: FakeSession, *arguments: str) -> int:
    return main_with(session, ["run", "harmonic", *arguments])


def test_without_options_the_paper_campaign_runs_unattended_in_a_folder_of_its_own(
    session: FakeSession, capsys: pytest.CaptureFixture[str]
):
    assert harmonic(session) == 0
    call = session.calls[0]
    assert call["parameters"] == HarmonicParameters()
    assert call["configuration"] == BenchConfiguration()
    assert call["operator"] == Unattended("the bench itself")
    assert call["out"].parent == Path("runs")
    assert call["out"].name.startswith("harmonic-20")
    assert ":" not in call["out"].name
    assert call["realtime"] is False
    shown = capsys.readouterr()
    assert shown.out.startswith("the table\n")
    assert "a step" in shown.err


@pytest.mark.parametrize("omega", [["--omega", "12.5", "15"], ["--omega", "12.5", "--omega", "15"]])
def test_lists_may_follow_one_flag_or_repeat_it(session: FakeSession, omega: list[str]):
    assert harmonic(session, *omega, "--beta", "0.5", "--starts", "3", "--realtime") == 0
    assert session.parameters == HarmonicParameters(omega=(12.5, 15.0), beta=(0.5,), starts=3)
    assert session.calls[0]["realtime"] is True


def test_flags_win_over_the_protocol_file_and_the_file_over_the_defaults(session: FakeSession):
    Path("harmonic.toml").write_text("omega = [14]\nstarts = 2\n", encoding="utf-8")
    assert harmonic(session, "--protocol-file", "harmonic.toml", "--starts", "9") == 0
    assert session.parameters == HarmonicParameters(omega=(14.0,), starts=9)


def test_the_seed_replaces_that_of_the_configuration_and_nothing_else(session: FakeSession):
    Path("bench.toml").write_text("[simulation]\nseed = 4\n[ramps]\nstop = 2.0\n", encoding="utf-8")
    assert harmonic(session, "--config", "bench.toml") == 0
    assert harmonic(session, "--config", "bench.toml", "--seed", "12") == 0
    first, second = (call["configuration"] for call in session.calls)
    assert (first.simulation.seed, second.simulation.seed) == (4, 12)
    assert second.ramps == first.ramps
    assert second.ramps.stop == 2.0


def test_help_gives_units_limits_and_defaults(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("COLUMNS", "200")
    assert main(["run", "harmonic", "--help"]) == 0
    shown = capsys.readouterr().out
    for text in (
        "--omega NUMBER...",
        "Circular frequencies of the base motion [rad/s] (each above 0 and at most 40)",
        "[default: 12.5 15 17.5 20 rad/s]",
        "[default: 240 s]",
        "--starts INT",
        "--out DIR",
    ):
        assert text in shown
    for name in HarmonicParameters.model_fields:
        assert "--" + name.replace("_", "-") in shown


def test_help_and_version_are_an_end_in_themselves(capsys: pytest.CaptureFixture[str]):
    for arguments in ([], ["--help"], ["run"], ["config", "--help"], ["--version"]):
        assert main(arguments) == 0
    assert capsys.readouterr().out.splitlines()[-1].startswith("rockbench 0.")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("--omega 0", "--omega = 0.0 is refused: it must be a number above 0 and at most 40 rad/s"),
        ("--omega 12 x", "--omega = 'x' is refused"),
        ("--omega", "--omega = [] is refused: it must be one or more numbers"),
        ("--omega inf", "--omega = 'inf' is refused: it must be a number above 0"),
        ("--beta -1", "--beta = -1.0 is refused"),
        ("--starts 1.5", "--starts = '1.5' is refused: it must be a whole number"),
        ("--starts 1 --starts 2", "--starts"),
        ("--omgea 12", "Did you mean --omega?"),
        ("twelve", "unexpected argument: twelve"),
        ("--seed x", "--seed = 'x' is refused"),
        ("--seed -1", "--seed = -1 is refused"),
        ("--config absent.toml", "absent.toml' is refused: there is no such file"),
        ("--config syntax.toml", "line 1"),
        ("--config unknown.toml", "unknown.toml: specimen.frame.k3 = 1.0 is refused: there is no such key"),
        ("--config negative.toml", "negative.toml: specimen.frame.k1 = -1.0 is refused"),
        ("--protocol-file absent.toml", "--protocol-file = 'absent.toml' is refused: there is no such file"),
        ("--protocol-file negative.toml", "negative.toml: specimen = 'a table' is refused"),
        ("--yes --ask", "use only one of them"),
        ("--out results", "--out = 'results' is refused: it already contains campaign.h5"),
        ("--out syntax.toml", "is a file"),
        ("--out syntax.toml/below", "is a file"),
    ],
)
def test_bad_input_is_refused_in_one_line_before_anything_starts(
    session: FakeSession, capsys: pytest.CaptureFixture[str], arguments: str, said: str
):
    Path("syntax.toml").write_text("k1 is 3\n", encoding="utf-8")
    Path("unknown.toml").write_text("[specimen.frame]\nk3 = 1.0\n", encoding="utf-8")
    Path("negative.toml").write_text("[specimen.frame]\nk1 = -1.0\n", encoding="utf-8")
    Path("results").mkdir()
    Path("results", "campaign.h5").touch()
    before = sorted(Path().rglob("*"))
    assert harmonic(session, *arguments.split()) == 2
    assert session.calls == []
    assert sorted(Path().rglob("*")) == before
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.count("\n") == 1
    assert shown.err.startswith("rockbench: error: ")
    assert said in shown.err


RESULTS = ("campaign.h5", "gain_spectra.png", "summary.json")


@pytest.mark.parametrize("name", RESULTS)
def test_no_result_is_overwritten(tmp_path: Path, name: str):
    check_folder(tmp_path, RESULTS)
    check_folder(tmp_path / "a" / "b", RESULTS)
    (tmp_path / name).touch()
    with pytest.raises(InvalidInput, match=f"already contains {name}"):
        check_folder(tmp_path, RESULTS)
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="needs a file system that nobody can write")
def test_a_folder_that_cannot_be_written_is_refused(session: FakeSession, capsys: pytest.CaptureFixture[str]):
    assert harmonic(session, "--out", "/proc/results") == 2
    assert "/proc cannot be written" in capsys.readouterr().err
    assert session.calls == []


@pytest.mark.parametrize(
    ("status", "code"), [("completed", 0), ("stopped", 0), ("aborted", 1), ("halted", 1), ("failed", 1)]
)
def test_json_is_all_there_is_on_standard_output(
    session: FakeSession, capsys: pytest.CaptureFixture[str], status: str, code: int
):
    session.status = status
    session.during = lambda _requests: print("a library that talks")
    assert harmonic(session, "--json", "--yes") == code
    shown = capsys.readouterr()
    assert shown.out.count("\n") == 1
    content = json.loads(shown.out)
    assert ("error" in content) == (code != 0)
    assert {**content, "error": 0} == {"status": status, "reason": "why it ended", "points": [1], "error": 0}
    assert "a library that talks" in shown.err
    assert ("rockbench: error: " in shown.err) == (code != 0)


def test_a_run_that_breaks_ends_with_1_and_a_refusal_by_the_session_with_2(
    session: FakeSession, capsys: pytest.CaptureFixture[str]
):
    def raising(error: Exception) -> Callable[[Requests], None]:
        def during(_requests: Requests) -> None:
            raise error

        return during

    for error, code in (
        (RigError("the rig went away"), 1),
        (OSError(28, "No space left on device"), 1),
        (InvalidInput("omega", 2.0, "beyond the stroke"), 2),
    ):
        session.during = raising(error)
        assert harmonic(session) == code
        shown = capsys.readouterr()
        assert shown.out == ""
        assert shown.err.splitlines()[-1] == f"rockbench: error: {error}"


def test_ctrl_c_aborts_then_halts_and_ends_with_130(session: FakeSession, capsys: pytest.CaptureFixture[str]):
    strengths: list[str | None] = []

    def during(requests: Requests) -> None:
        for _ in range(2):
            signal.raise_signal(signal.SIGINT)
            strengths.append(requests.strongest)

    session.status, session.during = "halted", during
    before = signal.getsignal(signal.SIGINT)
    assert harmonic(session, "--yes") == 130
    assert strengths == ["abort", "halt"]
    assert signal.getsignal(signal.SIGINT) is before
    assert "run halted" in capsys.readouterr().err


@pytest.mark.parametrize("item", ["--operator", "--note"])
def test_a_text_that_is_not_utf_8_is_refused_at_once(item: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    # as Python passes the Latin-1 bytes of "Müller"
    assert main(["check", item, "M\udcfcller", "--out", str(tmp_path / "run"), "--json"]) == 2
    shown = capsys.readouterr()
    assert f"{item} = 'M\\udcfcller' is refused: it must be UTF-8, and character 2 is not" in shown.err
    assert json.loads(shown.out)["error"]["item"] == item
    assert not (tmp_path / "run").exists()


def test_ctrl_c_breaks_the_wait_for_an_answer():
    class Keyboard(StringIO):
        def readline(self, _size: int = -1) -> str:
            signal.raise_signal(signal.SIGINT)
            return "yes\n"

    operator, requests = AtTheConsole(Keyboard(), StringIO()), Requests()
    with interruptible(requests, asking=lambda: operator.asking) as interrupts:
        assert operator.confirm("Stand the block up.") is False
    assert requests.strongest == "abort"
    assert interrupts.exit_code == 130


@pytest.mark.parametrize(("typed", "answer"), [("\n", True), ("what?\nY\n", True), ("no\n", False), ("", False)])
def test_the_operator_answers_at_the_console(typed: str, answer: bool):
    questions = StringIO()
    assert AtTheConsole(StringIO(typed), questions).confirm("Mount the spring.") is answer
    assert "Mount the spring.\n" in questions.getvalue()


def test_who_answers():
    assert choose(serves_itself=True, yes=False, ask=False, terminal=True) == Unattended("the bench itself")
    assert isinstance(choose(serves_itself=True, yes=False, ask=True, terminal=False), AtTheConsole)
    assert isinstance(choose(serves_itself=False, yes=False, ask=False, terminal=True), AtTheConsole)
    unattended = choose(serves_itself=False, yes=True, ask=False, terminal=False)
    assert unattended.confirm("Mount the spring.")
    assert "--yes" in unattended.name
    # the journal has the name in brackets
    line = OperatorAnswered("Mount the spring.", unattended.name, time=1.0).line
    assert line == "Mount the spring. (answered by unattended run, --yes)"
    assert columns_from("OperatorAnswered", line) == {"by": unattended.name}
    with pytest.raises(RockbenchError, match="use --yes"):
        choose(serves_itself=False, yes=False, ask=False, terminal=False)


def test_config_init_and_check(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    monkeypatch.chdir(tmp_path)
    assert main(["config", "init"]) == 0
    assert main(["config", "check", "rockbench.toml"]) == 0
    assert main(["config", "init"]) == 2
    assert "never overwritten" in capsys.readouterr().err
    text = Path("rockbench.toml").read_text(encoding="utf-8")
    Path("rockbench.toml").write_text(
        text.replace("k1 = 213.44", "k1 = -1").replace("xi1 =", "xi3 ="), encoding="utf-8"
    )
    assert main(["config", "check", "rockbench.toml"]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert all(line.startswith("rockbench: error: rockbench.toml: specimen.frame.") for line in lines)


def test_help_imports_nothing_that_only_a_run_needs():
    program = (
        "import sys; from bench.app.cli.main import main; main(['--help']); main(['run', 'harmonic', '--help']);"
        "heavy = {'numba', 'scipy', 'matplotlib', 'h5py', 'PySide6', 'pyqtgraph', 'nidaqmx', 'grpc', 'numpy'};"
        "sys.exit(' '.join(heavy & sys.modules.keys()) or 0)"
    )
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stderr) == (0, "")


@pytest.mark.skipif(os.name != "posix", reason="closes a pipe as POSIX shells do")
def test_a_reader_that_has_seen_enough_is_no_error() -> None:
    program = "from bench.app.cli.process import run; import sys; sys.argv[1:] = ['--help']; run()"
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as ran:
        assert ran.stdout is not None
        assert ran.stderr is not None
        ran.stdout.close()
        assert ran.stderr.read() == b""
    assert ran.returncode == 1


@pytest.mark.parametrize(("given", "used"), [({}, "1"), ({"OPENBLAS_NUM_THREADS": "2"}, "2")])
def test_a_command_uses_one_thread_of_blas_unless_told_otherwise(given: dict[str, str], used: str) -> None:
    program = (
        "import atexit, os, sys; assert 'numpy' not in sys.modules;"
        "atexit.register(lambda: print('threads', os.environ.get('OPENBLAS_NUM_THREADS')));"
        "from bench.app.cli.process import run; assert 'numpy' not in sys.modules; sys.argv[1:] = ['--version']; run()"
    )
    environment = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"} | given
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, env=environment)
    assert ran.stdout.split()[-2:] == ["threads", used]
