"""The kernel is edited under five kinds of installation, and no number is ever that of the old one.

Builds wheels and installs them, with everything they need, into environments of their own:

    uv run --dev pytest -n 0 -m soak tests/test_installations.py

Each kind is asked before the edit, after it, and after the edit is taken back. What is right is asked of the same
installation with an empty cache.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

pytestmark = [
    pytest.mark.soak,
    pytest.mark.timeout(1200),
    pytest.mark.skipif(shutil.which("uv") is None, reason="builds and installs with uv"),
]

PROJECT = Path(__file__).parents[1]
COMMAND = ("-m", "bench", "predict", "steady", "--omega", "16", "--beta", "0.4", "--json")
NOBODY = 65534
IN_MEMORY = "compiled in memory"
PHASES = tuple(f"rockbench: {phase}" for phase in ("loading the ", "compiling the model", "computing the "))
"""How lines begin that say what is in progress."""
LIGHTER = ("p[MASS] * p[GRAVITY] / p[INERTIA], ", "0.97 * p[MASS] * p[GRAVITY] / p[INERTIA], ")
"""The edit: gravity's moment on the rocking block, in sim/kernel/taylor.py, which other files call."""

not_windows = pytest.mark.skipif(sys.platform == "win32", reason="permissions of POSIX")
as_root = pytest.mark.skipif(
    sys.platform == "win32" or os.geteuid() != 0, reason="only root can start a process of another user"
)


def uv(*arguments: object) -> None:
    # in the project: its exact versions
    subprocess.run(["uv", *map(str, arguments)], cwd=PROJECT, check=True, capture_output=True, text=True)


def edit(kernel: Path, change: tuple[str, str]) -> None:
    source = kernel / "taylor.py"
    text = source.read_text()
    assert text.count(change[0]) == 1
    # a new file: an installation may share this one with uv's cache by a hard link
    edited = kernel / "edited"
    edited.write_text(text.replace(*change))
    edited.replace(source)


def back() -> tuple[str, str]:
    return LIGHTER[1], LIGHTER[0]


def ask(python: Path, home: Path | None, user: int | None = None, **more: str) -> tuple[float, str]:
    """alpha_2 that the installation predicts, and what it says on standard error."""
    ours = ("NUMBA_", "ROCKBENCH_", "XDG_", "PYTHON", "VIRTUAL_ENV", "HOME", "COV_")
    environment = {name: value for name, value in os.environ.items() if not name.startswith(ours)} | more
    if home is not None:
        environment |= {"HOME": str(home), "LOCALAPPDATA": str(home)}
    other: Mapping[str, object] = {} if user is None else {"user": user, "group": user, "extra_groups": []}
    done = subprocess.run(
        [str(python), *COMMAND],
        env=environment,
        cwd=python.parent,
        capture_output=True,
        text=True,
        **other,  # type: ignore[call-overload]
    )
    assert done.returncode == 0, done.stderr
    # what is in progress is not of interest here, a notice of the cache is
    said = "".join(line for line in done.stderr.splitlines(True) if not line.startswith(PHASES))
    return json.loads(done.stdout)["points"][0]["alpha_2"], said


@pytest.fixture(scope="module")
def place() -> Iterator[Path]:
    """A folder that other users can enter, unlike pytest's."""
    path = Path(tempfile.mkdtemp(prefix="installations-"))
    path.chmod(0o755)
    yield path
    shutil.rmtree(path)


@pytest.fixture(scope="module")
def interpreter() -> str:
    """A Python that other users can start too, where there is one."""
    if sys.platform != "win32" and os.geteuid() == 0:
        version = f"python{sys.version_info.major}.{sys.version_info.minor}"
        for found in (sys.base_prefix + "/bin/" + version, "/usr/bin/" + version):
            try:
                subprocess.run([found, "-c", ""], user=NOBODY, group=NOBODY, extra_groups=[], check=True)
            except (OSError, subprocess.CalledProcessError):
                continue
            return found
    return sys.executable


def sources(place: Path) -> Path:
    copy = place / "sources"
    if not copy.exists():
        ignored = shutil.ignore_patterns("__pycache__")
        for part in ("bench", "drivers", "sim", "protocols"):
            shutil.copytree(PROJECT / part, copy / part, ignore=ignored)
        for part in ("pyproject.toml", "README.md"):
            shutil.copy(PROJECT / part, copy)
    return copy


def environment(place: Path, interpreter: str, name: str, *what: object) -> tuple[Path, Path]:
    """Its Python and the folder of the kernel in it."""
    uv("venv", "--python", interpreter, place / name)
    python = place / name / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    uv("pip", "install", "--python", python, *what)
    code = "import importlib.util as u; print(u.find_spec('sim.kernel').submodule_search_locations[0])"
    found = subprocess.run([python, "-c", code], cwd=place, capture_output=True, text=True, check=True)
    return python, Path(found.stdout.strip())


@pytest.fixture(scope="module")
def wheels(place: Path) -> tuple[Path, Path]:
    """One of the kernel as it is, one of the edited kernel; of the same version."""
    copy = sources(place)
    built: list[Path] = []
    for name in ("old", "new"):
        uv("build", "--wheel", "--out-dir", place / name, copy)
        built.extend((place / name).glob("*.whl"))
        edit(copy / "sim" / "kernel", LIGHTER if name == "old" else back())
    old, new = built
    return old, new


@pytest.fixture(scope="module")
def installed(place: Path, interpreter: str, wheels: tuple[Path, Path]) -> tuple[Path, Path]:
    return environment(place, interpreter, "installed", wheels[0])


@pytest.fixture(scope="module")
def right(place: Path, installed: tuple[Path, Path]) -> tuple[float, float]:
    """alpha_2 before and after the edit, each compiled into an empty cache."""
    python, kernel = installed
    found: list[float] = []
    for number, change in enumerate((LIGHTER, back())):
        found.append(ask(python, None, NUMBA_CACHE_DIR=str(place / f"empty {number}"))[0])
        edit(kernel, change)
    old, new = found
    assert abs(new - old) > 1e-3
    return old, new


def home(place: Path, name: str, owner: int | None = None) -> Path:
    made = place / name
    made.mkdir()
    if owner is not None and sys.platform != "win32":
        os.chown(made, owner, owner)
    return made


def test_editable(place: Path, interpreter: str, wheels: tuple[Path, Path], right: tuple[float, float]) -> None:  # noqa: ARG001 - wheels are built of the same sources, which are as they were afterwards
    python, kernel = environment(place, interpreter, "editable", "--editable", sources(place))
    assert kernel == sources(place) / "sim" / "kernel"
    mine = home(place, "home of editable")
    assert ask(python, mine) == (right[0], "")
    edit(kernel, LIGHTER)
    assert ask(python, mine) == (right[1], "")
    edit(kernel, back())
    assert ask(python, mine) == (right[0], "")
    assert not list(mine.rglob("*.nbc"))


def test_wheel(
    place: Path, installed: tuple[Path, Path], wheels: tuple[Path, Path], right: tuple[float, float]
) -> None:
    python, _ = installed
    mine = home(place, "home of wheel")
    assert ask(python, mine) == (right[0], "")
    for wheel, expected in zip((wheels[1], wheels[0]), (right[1], right[0]), strict=True):
        uv("pip", "install", "--python", python, "--reinstall-package", "rocking-bench", "--no-deps", wheel)
        assert ask(python, mine) == (expected, "")


@not_windows
def test_read_only(place: Path, installed: tuple[Path, Path], right: tuple[float, float]) -> None:
    """As a user for whom it is: root may write everywhere."""
    python, kernel = installed
    user = NOBODY if os.geteuid() == 0 else None
    shutil.rmtree(kernel / "__pycache__")
    mine = home(place, "home of read-only", user)
    for change, expected in ((LIGHTER, right[0]), (back(), right[1]), (None, right[0])):
        kernel.chmod(0o555)
        assert ask(python, mine, user) == (expected, "")
        kernel.chmod(0o755)
        if change is not None:
            edit(kernel, change)
    assert not list(kernel.rglob("*.nbc"))
    assert len({path.parent for path in mine.rglob("*.nbc")}) == 2


@as_root
def test_other_user(place: Path, installed: tuple[Path, Path], right: tuple[float, float]) -> None:
    """Root has a cache in the installation, another user one in a home; each keeps to its own."""
    python, kernel = installed
    theirs, roots = home(place, "home of other user", NOBODY), home(place, "home of root")
    for change, expected in ((LIGHTER, right[0]), (back(), right[1]), (None, right[0])):
        assert ask(python, roots) == (expected, "")
        assert ask(python, theirs, NOBODY) == (expected, "")
        if change is not None:
            edit(kernel, change)
    assert not list(roots.rglob("*.nbc"))
    assert {path.stat().st_uid for path in kernel.rglob("*.nbc")} == {0}
    assert {path.stat().st_uid for path in theirs.rglob("*.nbc")} == {NOBODY}
    # root does not load what the other user has written, nor leaves anything in that home
    before = sorted(theirs.rglob("*"))
    shutil.rmtree(kernel / "__pycache__")
    (kernel / "__pycache__").touch()
    number, said = ask(python, theirs)
    (kernel / "__pycache__").unlink()
    assert number == right[0]
    assert "is owned by another user" in said
    assert IN_MEMORY in said
    assert sorted(theirs.rglob("*")) == before


@not_windows
def test_no_home(place: Path, installed: tuple[Path, Path], right: tuple[float, float]) -> None:
    python, kernel = installed
    nobody = os.geteuid() == 0
    for change, expected in ((LIGHTER, right[0]), (back(), right[1]), (None, right[0])):
        kernel.chmod(0o555)
        # root's entry among the users names a home even without HOME; nobody's names one that does not exist
        number, said = ask(python, None if nobody else place / "nowhere", NOBODY if nobody else None)
        kernel.chmod(0o755)
        assert number == expected
        if nobody:
            assert said.count(IN_MEMORY) == 1
            assert len(said.splitlines()) == 1
        if change is not None:
            edit(kernel, change)
