"""Without an extra, a command that needs it says in one line how to install it; every other command works."""

import json
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import pytest

from sim.extras import EXTRAS, MissingExtra, require

PROJECT = Path(__file__).parent.parent

BLOCKED = """
import json, sys
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO

class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {packages!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Absent())
from bench.app.cli.main import main
done = []
for argv in {lines!r}:
    out, err = StringIO(), StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = main(argv)
    done.append((code, out.getvalue(), err.getvalue()))
print(json.dumps(done))
"""

HARDWARE = 'backend = "hardware"\n'
ANALOGUE = HARDWARE + '[hardware.lasers]\nconnection = "analogue"\n'


class Done(NamedTuple):
    """What a command line came to."""

    returncode: int
    stdout: str
    stderr: str


def _without(extras: Iterable[str], *lines: list[str]) -> list[Done]:
    """The command lines, in one process, where the packages of `extras` cannot be imported."""
    packages = {package for extra in extras for package in EXTRAS[extra]}
    code = BLOCKED.format(packages=packages, lines=lines)
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return [Done(*each) for each in json.loads(ran.stdout)]


def _refused(done: Done | subprocess.CompletedProcess[str], extra: str) -> None:
    assert done.returncode == 2, done
    assert done.stdout == ""
    # a run first says what it is about to do
    (line,) = [each for each in done.stderr.splitlines() if each.startswith("rockbench: error: ")]
    assert "Traceback" not in done.stderr
    assert f'pip install "rocking-bench[{extra}]"' in line
    assert f"--extra {extra}" in line


def test_without_any_extra_a_command_names_what_it_needs_and_predictions_are_made() -> None:
    refused = {
        "gui": ["gui"],
        "ni": ["emulate"],
        "pdf": ["paper", "--only", "modes", "--pdf", "no-such-folder/paper.pdf"],
        "distributed": [
            *("predict", "map", "--omega", "15:17:2", "--beta", "0.3:0.4:2", "--scheduler", "tcp://localhost:1")
        ],
    }
    steady = ["predict", "steady", "--omega", "16", "--beta", "0.4", "--json"]
    *found, devices, prediction = _without(EXTRAS, *refused.values(), ["devices", "--json"], steady)
    for extra, done in zip(refused, found, strict=True):
        _refused(done, extra)
    assert (devices.returncode, devices.stderr) == (0, "")
    content = json.loads(devices.stdout)
    assert "rocking-bench[ni]" in content["reason"]
    assert "rocking-bench[serial]" in content["ports_reason"]
    assert (prediction.returncode, prediction.stderr) == (0, "")
    assert json.loads(prediction.stdout)["points"]


@pytest.mark.parametrize(
    ("extra", "device", "runs"),
    [
        ("ni", ["--server", "localhost:1"], [(HARDWARE, ["run", "laser-calibration"]), (ANALOGUE, ["check"])]),
        ("serial", ["--port", "COM9"], [(HARDWARE, ["check"])]),
    ],
)
def test_a_real_bench_names_the_one_extra_that_it_lacks_before_anything_starts(
    extra: str, device: list[str], runs: list[tuple[str, list[str]]], tmp_path: Path
) -> None:
    out, lines = tmp_path / "out", [["devices", *device]]
    for number, (configuration, command) in enumerate(runs):
        file = tmp_path / f"{number}.toml"
        file.write_text(configuration, encoding="utf-8")
        lines.append([*command, "--yes", "--config", str(file), "--out", str(out)])
    for done in _without([extra], *lines):
        _refused(done, extra)
    assert not out.exists()


def test_the_extras_are_those_of_the_project() -> None:
    declared = tomllib.loads((PROJECT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = declared["optional-dependencies"]
    assert extras.keys() == EXTRAS.keys() | {"all"}
    assert extras["all"] == [f"rocking-bench[{','.join(EXTRAS)}]"]


def test_the_error_names_what_was_asked_for() -> None:
    with pytest.raises(MissingExtra, match=r"--to uff needs no_such_package: pip install") as caught:
        require("export", "--to uff", "no_such_package")
    assert (caught.value.item, caught.value.value) == ("--to uff", "export")


@pytest.mark.soak
@pytest.mark.skipif(shutil.which("uv") is None, reason="uv makes the environment")
def test_an_environment_with_the_core_alone_runs_a_point(tmp_path: Path) -> None:
    environment = tmp_path / "core"
    python = environment / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")

    def run(*command: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([*command], cwd=tmp_path, capture_output=True, text=True, check=False)

    made = [
        run("uv", "build", "-q", "--wheel", "--out-dir", str(tmp_path), str(PROJECT)),
        run("uv", "venv", "-q", "--python", sys.executable, str(environment)),
        run("uv", "pip", "install", "-q", "--python", str(python), *map(str, tmp_path.glob("*.whl"))),
    ]
    assert [each.stderr for each in made if each.returncode] == []
    installed = run("uv", "pip", "list", "--python", str(python)).stdout.lower()
    assert not [
        name for name in ("pyside6", "nidaqmx", "pyserial", "pyarrow", "distributed", "pytest") if name in installed
    ]

    def rockbench(*argv: str) -> subprocess.CompletedProcess[str]:
        return run(str(python), "-m", "bench", *argv)

    point = rockbench(
        "run", "harmonic", "--omega", "16", "--beta", "0.4", "--seed", "3", "--yes", "--json", "--out", "a"
    )
    assert point.returncode == 0, point.stderr
    assert json.loads(point.stdout)["points"][0]["agrees"]
    campaign = str(tmp_path / "a" / "campaign.h5")
    assert rockbench("report", campaign).returncode == 0
    assert rockbench("export", campaign, "--to", "mat").returncode == 0
    (tmp_path / "bench.toml").write_text(HARDWARE, encoding="utf-8")
    for extra, argv in (
        ("gui", ["gui"]),
        ("ni", ["emulate"]),
        ("ni", ["check", "--yes", "--config", "bench.toml"]),
        ("serial", ["devices", "--port", "COM9"]),
        ("pdf", ["report", campaign, "--pdf", "a.pdf"]),
        ("export", ["export", campaign, "--to", "uff"]),
        ("export", ["export", campaign, "--to", "parquet"]),
        (
            "distributed",
            ["predict", "map", "--omega", "15:17:2", "--beta", "0.3:0.4:2", "--scheduler", "tcp://localhost:1"],
        ),
    ):
        _refused(rockbench(*argv), extra)
