"""The program on every supported Python with the lowest and the highest versions of its dependencies.

`python -m tests.compatibility` makes an environment of its own for each combination with uv, runs a point, a prediction
and the quick tests there, and prints a table. `--python 3.12`, `--resolution lowest-direct` and `--keep DIR` narrow it
down and keep environments and logs. The exit code is 1 when something failed.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

PROJECT = Path(__file__).parent.parent.parent
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
RESOLUTIONS = ("lowest-direct", "highest")
QUICK = (
    "tests/test_imports.py",
    "tests/sim/test_linear.py",
    "tests/sim/test_specimen.py",
    "tests/sim/test_sweep.py",
    "tests/bench/config/test_config.py",
    "tests/bench/app/cli/test_console.py",
    "tests/bench/app/cli/test_devices.py",
    "tests/bench/app/export/test_export.py",
    "tests/bench/app/cli/test_help_and_completion.py",
    "tests/bench/datafile/test_nexus.py",
    "tests/bench/document/test_page.py",
    "tests/bench/app/gui/test_gain_plot.py",
    "tests/bench/app/gui/test_header.py",
)
"""Tests that go through every direct dependency."""

POINT = ("run", "harmonic", "--omega", "16", "--beta", "0.4", "--seed", "3", "--yes", "--json", "--out", "point")
PREDICTION = ("predict", "steady", "--omega", "16", "--beta", "0.4", "--json")


@dataclass
class Row:
    """What came of one combination; an empty text has not been reached."""

    python: str
    resolution: str
    found: dict[str, str] = field(default_factory=dict[str, str])

    @property
    def failed(self) -> bool:
        return any(text.startswith("FAILED") for text in self.found.values())


def requirements() -> list[str]:
    """Every direct dependency with its bounds: of the core, of each extra and of the tests."""
    project = tomllib.loads((PROJECT / "pyproject.toml").read_text(encoding="utf-8"))
    extras = project["project"]["optional-dependencies"]
    wanted = [*project["project"]["dependencies"], *(each for name in extras if name != "all" for each in extras[name])]
    return [*wanted, *(each for each in project["dependency-groups"]["dev"] if not each.startswith("rocking-bench"))]


def interpreter(python: str) -> str | None:
    """Path of an interpreter that is on this machine, or None."""
    found = subprocess.run(
        ["uv", "python", "find", "--no-project", "--no-python-downloads", "--system", python],
        capture_output=True,
        text=True,
        check=False,
    )
    if found.returncode == 0:
        return found.stdout.strip()
    # pyenv hides those that are not chosen
    there = sorted(Path.home().glob(f".pyenv/versions/{python}.*/bin/python"))
    return str(there[-1]) if there else None


def tried(python: str, resolution: str, folder: Path) -> Row:
    """Go through one combination in the new `folder`, step by step, until one fails."""
    row = Row(python, resolution)
    path = interpreter(python)
    if path is None:
        row.found["install"] = "no such Python here"
        return row
    folder.mkdir(parents=True)
    inside = folder / "venv" / ("Scripts" if sys.platform == "win32" else "bin") / "python"
    (folder / "requirements.txt").write_text("\n".join(requirements()), encoding="utf-8")
    environment = {name: text for name, text in os.environ.items() if name not in ("VIRTUAL_ENV", "PYTHONPATH")}
    environment |= {"NUMBA_CACHE_DIR": str(folder / "kernel"), "QT_QPA_PLATFORM": "offscreen"}
    install = ("uv", "pip", "install", "--no-config", "--python", str(inside))
    # a bound whose release has no wheel for this Python is one that a user's installer cannot take either
    wheels = ("--only-binary", ":all:", "--resolution", resolution, "-r", "requirements.txt")
    program = (str(inside), "-m", "bench")
    steps = (
        ("install", folder, ("uv", "venv", "--python", path, "venv")),
        ("install", folder, (*install, *wheels)),
        ("install", folder, (*install, "--no-deps", "-e", str(PROJECT))),
        ("predict", folder, (*program, *PREDICTION)),
        ("point", folder, (*program, *POINT)),
        ("tests", PROJECT, (str(inside), "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider", *QUICK)),
    )
    for name, place, command in steps:
        done = subprocess.run(command, cwd=place, env=environment, capture_output=True, text=True, check=False)
        with (folder / "log.txt").open("a", encoding="utf-8") as log:
            log.write(f"$ {' '.join(command)}\n{done.stdout}{done.stderr}\n")
        row.found[name] = _outcome(name, done)
        if row.failed and name != "tests":
            break
    return row


def _outcome(name: str, done: subprocess.CompletedProcess[str]) -> str:
    last = ((done.stdout if name == "tests" else done.stderr).strip().splitlines() or [""])[-1]
    if done.returncode != 0:
        return f"FAILED: {last}"
    if name in ("point", "predict"):
        (point,) = json.loads(done.stdout)["points"]
        if name == "point" and not point["agrees"]:
            return "FAILED: the point disagrees with its prediction"
        return f"alpha_2 {point['alpha_2']:.6f}"
    return last if name == "tests" else "ok"


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.compatibility", description=__doc__)
    parser.add_argument("--python", nargs="+", default=PYTHONS, metavar="VERSION")
    parser.add_argument("--resolution", nargs="+", default=RESOLUTIONS, choices=RESOLUTIONS)
    parser.add_argument("--keep", type=Path, metavar="DIR", help="folder for environments and logs")
    asked = parser.parse_args()
    rows: list[Row] = []
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as temporary:
        for python in asked.python:
            for resolution in asked.resolution:
                row = tried(python, resolution, (asked.keep or Path(temporary)) / f"{python}-{resolution}")
                rows.append(row)
                cells = (row.found.get(name, "") for name in ("install", "predict", "point", "tests"))
                print(f"| {python} | {resolution} | {' | '.join(cells)} |", flush=True)
    return int(any(row.failed for row in rows))


if __name__ == "__main__":
    sys.exit(main())
