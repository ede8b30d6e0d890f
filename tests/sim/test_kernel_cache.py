"""The kernel's cache: never the code of other sources, never from a folder that others can write, never for ever.

Each run is a process of its own, on a copy of the kernel with two small functions more: one in `caller` that calls one
in `callee`, because numba by itself does not notice that the callee was edited. All but a few are forked from a process
that has imported numba.
"""

import os
import pickle
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest
from _pytest.mark import ParameterSet

import sim.kernel
from tests.forked import Programs

posix = pytest.mark.skipif(sys.platform == "win32", reason="permissions of POSIX")
root = pytest.mark.skipif(
    sys.platform == "win32" or os.geteuid() != 0, reason="only root can give files to another user"
)


def long(*values: object) -> ParameterSet:
    """Another place for what is shown in one already: only when long tests are asked for."""
    return pytest.param(*values, marks=pytest.mark.soak)


CALLEE = """from sim.kernel.compiled import compiled
@compiled("float64(float64)")
def callee(x):
    return {factor} * x
"""
CALLER = """from sim.kernel.callee import callee
from sim.kernel.compiled import compiled
@compiled("float64(float64)")
def caller(x):
    return callee(x) + 1.0
"""
NEAR = """from sim.kernel.callee import callee as kernels
from sim.kernel.compiled import compiled
@compiled("float64(float64)")
def callee(x):
    return kernels(x) + {term}
"""
FUNCTION = """@compiled("float64(float64)")
def {name}(x):
    return caller(x) * 2.0
"""
ASK = "from sim.kernel.caller import caller; print(caller(1.0))"
NOTICE = "compiled in memory"
PRELOAD = """import os, sys
sys.modules["scipy"] = None
os.environ.update(NUMBA_OPT="2", NUMBA_LOOP_VECTORIZE="0", NUMBA_SLP_VECTORIZE="0")
import concurrent.futures, multiprocessing, numba
numba.njit("float64(float64)", nogil=True, error_model="numpy", no_cfunc_wrapper=True)(lambda x: 2.0 * x + 1.0)
"""
"""numba with the settings of sim.kernel, and what every first compilation loads."""
PREPARE = "import numba; numba.core.config.reload_config(); del numba"


class Installation:
    """A copy of the kernel, with its own home and environment."""

    def __init__(self, place: Path, programs: Programs) -> None:
        self.programs = programs
        self.site, self.home = place / "site", place / "home"
        self.kernel = self.site / "sim" / "kernel"
        self.home.mkdir()
        self.kernel.mkdir(parents=True)
        (self.site / "sim" / "__init__.py").touch()
        for source in Path(sim.kernel.__file__).parent.glob("*.py"):
            shutil.copy(source, self.kernel)
        (self.kernel / "caller.py").write_text(CALLER)
        # numba looks for the BLAS of scipy, which the kernel does not use: a quarter of the time of these processes
        (self.site / "scipy.py").write_text("raise ImportError('not in these tests')\n")
        self.edit(2.0)
        ours = ("NUMBA_", "ROCKBENCH_", "XDG_", "PYTHON", "COV_")
        self.environment = {name: value for name, value in os.environ.items() if not name.startswith(ours)}
        self.environment |= {"PYTHONPATH": str(self.site), "PYTHONDONTWRITEBYTECODE": "1", "HOME": str(self.home)}
        self.environment["LOCALAPPDATA"] = str(self.home)

    def edit(self, factor: float) -> None:
        (self.kernel / "callee.py").write_text(CALLEE.format(factor=factor))

    def cannot_be_written(self) -> None:
        """For root too: what is no folder takes no files."""
        (self.kernel / "__pycache__").touch()

    def has_no_home(self) -> None:
        shutil.rmtree(self.home)
        self.home.touch()

    def run(self, code: str = ASK, *, fresh: bool = False) -> tuple[str, str]:
        """What the process prints to standard output and standard error; `fresh`: it imports numba itself."""
        done = self.programs.run(code, self.environment, self.site, fresh=fresh)
        assert done.returncode == 0, done.stderr
        return done.stdout.strip(), done.stderr.strip()


@pytest.fixture(scope="module")
def programs() -> Iterator[Programs]:
    with Programs(PRELOAD, PREPARE) as ready:
        yield ready


@pytest.fixture
def installation(tmp_path: Path, programs: Programs) -> Installation:
    return Installation(tmp_path, programs)


Choice = Callable[[Installation], Path]


def beside(installation: Installation) -> Path:
    return installation.kernel / "__pycache__"


def at_home(installation: Installation) -> Path:
    installation.cannot_be_written()
    return installation.home


def where_the_user_says(installation: Installation) -> Path:
    place = installation.home / "mine"
    installation.environment["NUMBA_CACHE_DIR"] = str(place)
    return place


def test_whatever_imports_numba_first_finds_the_kernels_settings(installation: Installation) -> None:
    """Else `table`, which imports numba before the decorator, would compile all of the kernel a second time."""
    code = (
        "import os, sys\nsys.modules['numba'] = None\ntry:\n    import sim.kernel.table\n"
        "except ImportError:\n    print(os.environ.get('NUMBA_OPT'), os.environ.get('NUMBA_LOOP_VECTORIZE'))"
    )
    assert installation.run(code, fresh=True) == ("2 0", "")


def test_a_package_that_calls_the_kernel_is_compiled_again_after_an_edit_there_and_in_itself(
    installation: Installation,
) -> None:
    """As the comparators are: numba itself looks only at the file of the function."""
    peers = installation.site / "peers"
    peers.mkdir()
    (peers / "__init__.py").touch()
    (peers / "far.py").write_text(CALLER.replace("sim.kernel.callee", "peers.near"))

    def edit(term: float) -> None:
        (peers / "near.py").write_text(NEAR.format(term=term))

    ask = "from peers.far import caller; print(caller(1.0))"
    edit(10.0)
    assert installation.run(ask) == ("13.0", "")
    edit(20.0)
    assert installation.run(ask) == ("23.0", "")
    installation.edit(30.0)
    assert installation.run(ask) == ("51.0", "")
    assert list((peers / "__pycache__").rglob("far.*.nbc"))


@pytest.mark.parametrize("choose", [beside, at_home, where_the_user_says])
def test_an_edited_kernel_is_compiled_again_wherever_the_cache_is(installation: Installation, choose: Choice) -> None:
    place = choose(installation)
    assert installation.run() == ("3.0", "")
    made = set(place.rglob("*.nbc"))
    assert len(made) == 2
    installation.edit(30.0)
    assert installation.run() == ("31.0", "")
    # and back: what was compiled first is still there
    installation.edit(2.0)
    assert installation.run() == ("3.0", "")
    assert made < set(place.rglob("*.nbc"))
    assert len(list(place.rglob("*.nbc"))) == 4


def test_without_any_place_it_is_compiled_in_memory_and_said_once(installation: Installation) -> None:
    installation.cannot_be_written()
    installation.has_no_home()
    children = (
        "import multiprocessing, operator\n"
        "if __name__ == '__main__':\n"
        "    from sim.kernel.caller import caller\n"
        "    with multiprocessing.get_context('spawn').Pool(1) as pool:\n"
        "        print(caller(1.0), pool.apply(operator.methodcaller('__call__', 1.0), (caller,)))\n"
    )
    out, err = installation.run(children)
    assert out == "3.0 3.0"
    assert err.count(NOTICE) == 1
    assert len(err.splitlines()) == 1
    assert "NUMBA_CACHE_DIR" in err
    installation.edit(30.0)
    assert installation.run()[0] == "31.0"


def test_the_folder_that_the_user_names_must_be_usable(installation: Installation) -> None:
    (installation.home / "file").touch()
    installation.environment["NUMBA_CACHE_DIR"] = str(installation.home / "file")
    out, err = installation.run()
    assert out == "3.0"
    assert f"{installation.home / 'file'} is not a folder" in err
    assert not beside(installation).exists()


def test_a_kernel_in_an_archive_is_never_stale(installation: Installation) -> None:
    archive = installation.site / "packages.zip"
    installation.environment["PYTHONPATH"] = str(archive)
    for factor, expected in ((2.0, "3.0"), (30.0, "31.0")):
        installation.edit(factor)
        with zipfile.ZipFile(archive, "w") as packed:
            for source in sorted(installation.site.rglob("*.py")):
                packed.write(source, source.relative_to(installation.site))
        out, err = installation.run("import os; os.chdir('/'); import sys; sys.path.remove(''); " + ASK)
        assert out == expected
        assert NOTICE in err


def test_an_update_while_the_kernel_is_loaded_leaves_nothing_behind(installation: Installation) -> None:
    updated = CALLEE.format(factor=30.0)
    meanwhile = (
        f"import sim.kernel.compiled; open({str(installation.kernel / 'callee.py')!r}, 'w').write({updated!r}); "
    )
    out, err = installation.run(meanwhile + ASK)
    assert out == "31.0"
    assert "changed while they were loaded" in err
    installation.edit(2.0)
    assert installation.run() == ("3.0", "")


@pytest.mark.parametrize("parts", [("first", "second"), long(("roots", "equations"))])
def test_threads_that_load_parts_of_the_kernel_together(installation: Installation, parts: Sequence[str]) -> None:
    for part in {"first", "second"} & {*parts}:
        functions = "".join(FUNCTION.format(name=f"{part}{number}") for number in range(5))
        (installation.kernel / f"{part}.py").write_text(CALLER + functions)
    modules = [f"sim.kernel.{part}" for part in ("caller", *parts)]
    code = (
        "from concurrent.futures import ThreadPoolExecutor as P; from importlib import import_module as i\n"
        f"with P(3) as pool: list(pool.map(i, {modules}))\n"
    )
    assert installation.run(code + ASK) == ("3.0", "")
    outside = [path for path in installation.site.parent.rglob("*.nb?") if "rockbench-" not in str(path)]
    assert outside == []
    installation.edit(30.0)
    assert installation.run(code + ASK) == ("31.0", "")


def test_a_place_that_numba_takes_instead_is_not_used(installation: Installation) -> None:
    # as it does by itself where the folder's disk is full
    installation.environment["NUMBA_CACHE_LOCATOR_CLASSES"] = "InTreeCacheLocator"
    assert installation.run()[0] == "3.0"
    installation.edit(30.0)
    assert installation.run()[0] == "31.0"


def test_numba_functions_of_others_keep_their_own_caches(installation: Installation) -> None:
    theirs = installation.site / "theirs.py"
    theirs.write_text("import numba\n@numba.njit('int64(int64)', cache=True)\ndef f(x): return x\n")
    installation.run("import sim.kernel.caller, theirs")
    assert list((installation.site / "__pycache__").glob("theirs.f*.nbc"))


@pytest.mark.parametrize(("kind", "kept"), [("nbi", 0), long("nbc", 40)])
def test_a_damaged_file_in_the_cache_is_not_the_end(installation: Installation, kind: str, kept: int) -> None:
    installation.run()
    for path in beside(installation).rglob(f"*.{kind}"):
        path.write_bytes(path.read_bytes()[:kept])
    out, err = installation.run()
    assert out == "3.0"
    assert "remove this folder" in err


class _Attack:
    """Runs a command when it is unpickled."""

    def __init__(self, marker: Path) -> None:
        self.marker = marker

    def __reduce__(self) -> tuple[object, ...]:
        return os.mkdir, (str(self.marker),)


def poison(place: Path, marker: Path) -> None:
    paths = list(place.rglob("*.nb?"))
    assert paths
    for path in paths:
        path.write_bytes(pickle.dumps(_Attack(marker)))


@posix
@pytest.mark.parametrize(("choose", "mode"), [(beside, 0o770), long(at_home, 0o1777), long(where_the_user_says, 0o777)])
def test_a_cache_that_others_can_write_is_not_loaded(installation: Installation, choose: Choice, mode: int) -> None:
    place = choose(installation)
    installation.run()
    poison(place, installation.home / "attacked")
    (folder,) = place.rglob("rockbench-*")
    folder.chmod(mode)
    out, err = installation.run()
    assert out == "3.0"
    assert not (installation.home / "attacked").exists()
    assert f"{folder} can be written by others" in err
    assert len(err.splitlines()) == 1


@posix
@pytest.mark.parametrize("choose", [beside, long(where_the_user_says)])
def test_nor_is_one_in_a_folder_in_which_others_can_replace_it(installation: Installation, choose: Choice) -> None:
    place = choose(installation)
    installation.run()
    poison(place, installation.home / "attacked")
    place.chmod(0o777)
    out, err = installation.run()
    assert out == "3.0"
    assert not (installation.home / "attacked").exists()
    assert f"{place} can be written by others" in err


@root
@pytest.mark.parametrize("choose", [long(beside), at_home])
def test_a_cache_of_another_user_is_not_loaded(installation: Installation, choose: Choice) -> None:
    place = choose(installation)
    installation.run()
    poison(place, installation.home / "attacked")
    (folder,) = place.rglob("rockbench-*")
    os.chown(folder, 65534, 65534)
    out, err = installation.run()
    assert out == "3.0"
    assert not (installation.home / "attacked").exists()
    if choose is not beside:  # there the user's own folder takes its place
        assert "is owned by another user" in err
        assert NOTICE in err


def claimed(version: str) -> str:
    return f"from sim.kernel.cache import KernelCache; print(KernelCache('', [{version!r}]).folder())"


def test_old_folders_go_but_none_that_a_process_uses(installation: Installation) -> None:
    from sim.kernel.cache import KEPT

    holds = "import sys; from sim.kernel.cache import KernelCache; k = KernelCache('', ['held']); " + (
        "print(k.folder(), flush=True); sys.stdin.read()"
    )
    with subprocess.Popen(
        [sys.executable, "-c", holds],
        env=installation.environment,
        cwd=installation.site,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as holder:
        assert holder.stdout is not None
        assert holder.stdin is not None
        held = Path(holder.stdout.readline().strip())
        (held / "code").touch()
        used = [Path(installation.run(claimed(str(i)))[0]) for i in range(KEPT + 4)]
        assert held.is_dir()
        assert (held / "code").exists()
        holder.stdin.close()
    assert used[-1].is_dir()
    assert not used[0].exists()
    assert len(list(beside(installation).iterdir())) <= KEPT + 2
    more = [Path(installation.run(claimed(f"more {i}"))[0]) for i in range(2)]
    assert more[-1].is_dir()
    assert not held.exists()


@pytest.mark.parametrize("times", [4, pytest.param(400, marks=pytest.mark.soak)])
def test_processes_that_start_and_clear_up_together_all_get_a_folder(times: int, installation: Installation) -> None:
    code = (
        "import sys\nfrom sim.kernel.cache import KernelCache\n"
        f"for i in range({times}):\n"
        "    k = KernelCache('', [i * 7 % 10]); f = k.folder()\n"
        "    assert f is not None and f.is_dir() and (f / 'in-use').exists()\n"
        "    k.release()\n"
    )
    running = [
        subprocess.Popen(
            [sys.executable, "-c", code], env=installation.environment, cwd=installation.site, stderr=subprocess.PIPE
        )
        for _ in range(3)
    ]
    for process in running:
        _, errors = process.communicate()
        assert process.returncode == 0, errors.decode()
        assert errors == b""
