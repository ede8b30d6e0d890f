"""Without an extra, a command that needs it says in one line how to install it; every other command works."""

import json
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from sim.extras import EXTRAS, MissingExtra, require

PROJECT = Path(__file__).parent.parent

BLOCKED = """
import sys

class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {packages!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Absent())
from bench.app.cli.main import main
sys.exit(main({argv!r}))
"""

HARDWARE = 'backend = "hardware"\n'
ANALOGUE = HARDWARE + '[hardware.lasers]\nconnection = "analogue"\n'


def _without(extras: tuple[str, ...], argv: list[str]) -> subprocess.CompletedProcess[str]:
    """The command line where the packages of `extras` cannot be imported."""
    packages = {package for extra in extras for package in EXTRAS[extra]}
    code = BLOCKED.format(packages=packages, argv=argv)
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)


def _refused(done: subprocess.CompletedProcess[str], extra: str) -> None:
    assert done.returncode == 2, done
    assert done.stdout == ""
    # a run first says what it is about to do
    (line,) = [each for each in done.stderr.splitlines() if each.startswith("rockbench: error: ")]
    assert "Traceback" not in done.stderr
    assert f'pip install "rocking-bench[{extra}]"' in line
    assert f"--extra {extra}" in line


@pytest.mark.parametrize(
    ("extra", "argv"),
    [
        ("gui", ["gui"]),
        ("ni", ["emulate"]),
        ("ni", ["devices", "--server", "localhost:1"]),
        ("serial", ["devices", "--port", "COM9"]),
        ("pdf", ["paper", "--only", "modes", "--pdf", "no-such-folder/paper.pdf"]),
        (
            "distributed",
            ["predict", "map", "--omega", "15:17:2", "--beta", "0.3:0.4:2", "--scheduler", "tcp://localhost:1"],
        ),
    ],
)
def test_a_command_names_the_extra_that_it_needs(extra: str, argv: list[str]) -> None:
    _refused(_without((extra,), argv), extra)


@pytest.mark.parametrize(
    ("extra", "configuration", "command"),
    [
        ("ni", HARDWARE, ["run", "harmonic", "--yes"]),
        ("ni", ANALOGUE, ["check", "--yes"]),
        ("serial", HARDWARE, ["check", "--yes"]),
    ],
)
def test_a_real_bench_names_the_extra_before_anything_starts(
    extra: str, configuration: str, command: list[str], tmp_path: Path
) -> None:
    file, out = tmp_path / "bench.toml", tmp_path / "out"
    file.write_text(configuration, encoding="utf-8")
    _refused(_without((extra,), [*command, "--config", str(file), "--out", str(out)]), extra)
    assert not out.exists()


def test_devices_tells_of_what_cannot_be_looked_for() -> None:
    done = _without(("ni", "serial"), ["devices", "--json"])
    assert (done.returncode, done.stderr) == (0, "")
    found = json.loads(done.stdout)
    assert "rocking-bench[ni]" in found["reason"]
    assert "rocking-bench[serial]" in found["ports_reason"]


def test_without_any_extra_predictions_are_made() -> None:
    done = _without(tuple(EXTRAS), ["predict", "steady", "--omega", "16", "--beta", "0.4", "--json"])
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout)["points"]


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
