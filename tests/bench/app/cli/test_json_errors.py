"""With --json, an error is one object on standard output, with a code from the closed list of docs/errors.md."""

import importlib
import json
import pkgutil
import re
from pathlib import Path
from typing import Any, get_args

import pytest

from bench.app.cli.main import main, rockbench_app
from bench.app.cli.output import Code, print_result
from drivers.errors import ConnectionLost
from sim.errors import InvalidInput, RockbenchError
from tests.command_line import FakeSession, commands, main_with

PAGE = Path(__file__).parents[4] / "docs" / "errors.md"
Said = pytest.CaptureFixture[str]


def _error(said: Said, *, alone: bool = True) -> dict[str, Any]:
    out, err = said.readouterr()
    (line,) = out.splitlines()
    content = json.loads(line)
    assert not alone or content.keys() == {"error"}
    error = content["error"]
    assert error.keys() == {"code", "message", "item", "value", "remedy"}
    assert err.splitlines()[-1].startswith("rockbench: error: ")
    return error


@pytest.mark.parametrize(
    ("argv", "code", "item"),
    [
        (["run", "harmonic", "--json", "--no-such-flag"], "usage", None),
        (["predict", "--json", "no-such-command"], "usage", None),
        (["no-such-command", "--json"], "usage", None),
        (["records", "info", "--json"], "invalid_input", "FILE"),
        (["run", "harmonic", "--beta", "-1", "--json"], "invalid_input", "--beta"),
        (["predict", "steady", "--omega", "x", "--json"], "invalid_input", "--omega"),
        (["run", "harmonic", "--yes", "--ask", "--json"], "error", None),
        (["queue", "none.json", "--json"], "invalid_input", None),
        (["replay", "none.h5", "--json"], "invalid_input", None),
        (["analyse", "none.h5", "--json"], "invalid_input", None),
        (["file", "info", "none.h5", "--json"], "invalid_input", None),
        (["file", "verify", "none.h5", "--json"], "invalid_input", None),
        (["file", "recover", "none.h5", "--json"], "invalid_input", None),
        (["devices", "--config", "none.toml", "--json"], "invalid_input", "configuration file"),
        (["check", "--config", "none.toml", "--json"], "invalid_input", "configuration file"),
    ],
)
def test_what_is_refused_has_a_code(
    argv: list[str], code: str, item: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Said
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(argv) == 2
    error = _error(capsys)
    assert error["code"] == code
    if code == "invalid_input":
        assert error["remedy"]
        assert item in (None, error["item"])
    assert list(tmp_path.iterdir()) == []


def test_every_command_with_json_has_it_for_what_cannot_be_parsed(capsys: Said) -> None:
    tried = 0
    for path, command in commands(rockbench_app()):
        if command.default_command is not None and "--json" in command.assemble_argument_collection():
            assert main([*path, "--json", "--no-such-option"]) == 2, path
            assert _error(capsys)["code"] == "usage", path
            tried += 1
    assert tried > 20


@pytest.mark.parametrize(("error", "code"), [(ConnectionLost("gone"), "connection_lost"), (OSError("full"), "system")])
def test_a_run_that_breaks_has_the_code_of_what_it_broke_with(
    error: Exception, code: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Said
) -> None:
    monkeypatch.chdir(tmp_path)

    def during(_requests: object) -> None:
        raise error

    assert main_with(FakeSession(during=during), ["run", "harmonic", "--json", "--yes"]) == 1
    found = _error(capsys)
    assert (found["code"], found["message"]) == (code, str(error))


@pytest.mark.parametrize(
    ("status", "code"), [("failed", "run_failed"), ("aborted", "run_aborted"), ("halted", "run_aborted")]
)
def test_a_run_that_ends_badly_keeps_its_results_beside_the_error(
    status: str, code: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Said
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main_with(FakeSession(status), ["run", "harmonic", "--json", "--yes"]) == 1
    assert _error(capsys, alone=False)["code"] == code


def test_an_interrupt_has_a_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    monkeypatch.chdir(tmp_path)

    def during(_requests: object) -> None:
        raise KeyboardInterrupt

    assert main_with(FakeSession(during=during), ["run", "harmonic", "--json", "--yes"]) == 130
    assert _error(capsys)["code"] == "interrupted"


def test_a_dry_run_that_is_refused_is_one_object(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bench.toml").write_text("[limits]\nforce = 5.0\n", encoding="utf-8")
    argv = ["run", "laser-calibration", "--config", "bench.toml", "--dry-run", "--json"]
    assert main(argv) == 2
    assert _error(capsys, alone=False)["code"] == "invalid_input"


def test_a_number_that_is_not_finite_is_null_in_a_result(capsys: Said) -> None:
    content = {"value": float("nan"), "rows": [{"peak": float("inf"), "samples": 3}]}
    print_result(lambda: content, lambda: "text", as_json=True, error="it failed", code="run_failed")
    found = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    assert found["error"]["code"] == "run_failed"
    assert {key: found[key] for key in content} == {"value": None, "rows": [{"peak": None, "samples": 3}]}


def test_without_json_nothing_is_on_standard_output(capsys: Said) -> None:
    assert main(["run", "harmonic", "--beta", "-1"]) == 2
    assert capsys.readouterr().out == ""


def test_the_codes_are_those_of_the_page() -> None:
    for package in ("bench", "drivers", "protocols", "sim"):
        found = importlib.import_module(package)
        for module in pkgutil.walk_packages(found.__path__, f"{package}."):
            if not module.name.endswith("__main__"):
                importlib.import_module(module.name)

    def codes(kind: type[RockbenchError]) -> set[str]:
        return {kind.error_code}.union(*(codes(each) for each in kind.__subclasses__()))

    own = codes(RockbenchError)
    documented = re.findall(r"^\| `(\w+)` \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(documented) == sorted(own | set(get_args(Code)))
    assert InvalidInput.error_code == "invalid_input"
