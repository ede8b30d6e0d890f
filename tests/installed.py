"""Packages beside the project, as an installer would leave them: found by their entry points, here and in children."""

import importlib
import os
import shutil
import sys
import tomllib
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from pathlib import Path

import pytest

PLUGINS = Path(__file__).parent / "plugins"


@contextmanager
def installed(folder: Path, name: str, entry_points: Mapping[str, Mapping[str, str]]) -> Generator[None]:
    """Within, `folder` is on the path of this process and its children, with the metadata of a package `name` whose
    `entry_points` are given by group.
    """
    metadata = folder / f"{name.replace('-', '_')}-1.0.dist-info"
    metadata.mkdir(parents=True)
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n", encoding="utf-8")
    lines = [
        line
        for group, entries in entry_points.items()
        for line in (f"[{group}]", *(f"{key} = {value}" for key, value in entries.items()))
    ]
    (metadata / "entry_points.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        before = os.environ.get("PYTHONPATH")
        patch.setenv("PYTHONPATH", str(folder) if before is None else f"{folder}{os.pathsep}{before}")
        patch.setattr(sys, "path", [*sys.path, str(folder)])
        importlib.invalidate_caches()
        yield
    importlib.invalidate_caches()


@contextmanager
def example(folder: Path, name: str) -> Generator[Path]:
    """Within, the example package `name` of docs/extending.md is installed in `folder`; its one module."""
    module = PLUGINS / name / f"{name}.py"
    folder.mkdir(exist_ok=True)
    shutil.copy(module, folder)
    project = tomllib.loads((module.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    with installed(folder, project["name"], project["entry-points"]):
        yield module
