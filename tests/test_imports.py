"""Importing the packages stays light: no Qt, no drivers, no compiler, no plotting."""

import subprocess
import sys

PACKAGES = "import bench, drivers, sim, protocols"
HEAVY = {"PySide6", "pyqtgraph", "nidaqmx", "grpc", "serial", "matplotlib", "numba", "scipy", "h5py"}


def _run(code: str) -> str:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout


def test_the_packages_pull_in_nothing_heavy() -> None:
    loaded = _run(f"import sys; {PACKAGES}; print(*sorted({{name.split('.')[0] for name in sys.modules}}))").split()
    assert not HEAVY & set(loaded)


def test_a_specimen_is_described_without_a_compiler() -> None:
    loaded = _run("import sys; import sim.specimen, sim.excitation, bench.config.model; print(*sys.modules)").split()
    assert not HEAVY & {name.split(".")[0] for name in loaded}


def test_a_headless_run_needs_no_window_no_driver_and_no_plot_until_its_end() -> None:
    loaded = _run("import sys; import bench.app.session, protocols.harmonic.campaign; print(*sys.modules)").split()
    assert not {"PySide6", "pyqtgraph", "nidaqmx", "grpc", "serial", "matplotlib"} & {
        name.split(".")[0] for name in loaded
    }


def test_the_command_line_starts_without_the_window() -> None:
    loaded = _run("import sys; import bench.app.cli.main; print(*sys.modules)").split()
    assert not {"PySide6", "pyqtgraph"} & {name.split(".")[0] for name in loaded}


def test_the_number_of_threads_is_set_before_numpy_is_imported() -> None:
    """By the configuration of the tests: numpy's library reads it once, and its threads compete with the processes."""
    assert "numpy" not in _run("import sys; import tests.conftest; print(*sys.modules)").split()
