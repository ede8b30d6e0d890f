"""Metadata, and what is in the wheel and in the source distribution."""

import shutil
import subprocess
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGES = ("bench", "drivers", "protocols", "sim")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def _sources() -> set[str]:
    """Every file of the packages but compiled ones."""
    found = (path for package in PACKAGES for path in (ROOT / package).rglob("*") if path.is_file())
    return {path.relative_to(ROOT).as_posix() for path in found if "__pycache__" not in path.parts}


def test_every_package_says_that_it_has_types() -> None:
    assert all((ROOT / package / "py.typed").is_file() for package in PACKAGES)
    assert "Typing :: Typed" in PROJECT["classifiers"]


def test_the_citation_is_that_of_this_version() -> None:
    lines = (ROOT / "CITATION.cff").read_text(encoding="utf-8").splitlines()
    assert f"version: {PROJECT['version']}" in lines
    assert f"title: {PROJECT['name']}" in lines


def test_the_metadata_name_developers_and_every_tested_python() -> None:
    assert PROJECT["authors"] == [{"name": "rocking-bench developers"}]
    assert PROJECT["keywords"]
    from tests.compatibility.__main__ import PYTHONS

    named = [each.rpartition(" ")[2] for each in PROJECT["classifiers"] if "Python :: 3." in each]
    assert set(named) <= set(PYTHONS)
    # no upper bound: a new Python is tried, not refused
    assert PROJECT["requires-python"] == f">={PYTHONS[0]}"


@pytest.mark.soak
@pytest.mark.skipif(shutil.which("uv") is None, reason="uv builds the distributions")
def test_the_distributions_hold_all_of_the_packages_and_the_wheel_no_tests(tmp_path: Path) -> None:
    subprocess.run(["uv", "build", "-q", "--out-dir", str(tmp_path), str(ROOT)], check=True)
    (wheel,) = tmp_path.glob("*.whl")
    (source,) = tmp_path.glob("*.tar.gz")
    in_wheel = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    assert in_wheel == _sources()
    with tarfile.open(source) as archive:
        in_source = {name.partition("/")[2] for name in archive.getnames()}
    assert _sources() | {"README.md", "CITATION.cff", "CHANGELOG.md", "pyproject.toml"} <= in_source
