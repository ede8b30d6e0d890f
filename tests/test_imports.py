"""Importing the packages stays light: no Qt, no drivers, no compiler, no plotting."""

import json
import subprocess
import sys

import pytest

WINDOW = {"PySide6", "pyqtgraph"}
PLOTS_AND_DRIVERS = {*WINDOW, "nidaqmx", "grpc", "serial", "matplotlib"}
HEAVY = {*PLOTS_AND_DRIVERS, "numba", "scipy", "h5py"}
STAGES = {
    # numpy's library reads the number of threads once, and its threads compete with the processes
    "tests.conftest": {"numpy"},
    "bench, drivers, sim, protocols": HEAVY,
    "sim.specimen, sim.excitation, bench.config.model": HEAVY,
    "bench.app.cli.main": WINDOW,
    "bench.app.session, protocols.harmonic.campaign": PLOTS_AND_DRIVERS,
}
"""What must not have been imported when these modules have been, one after the other in one process."""


@pytest.fixture(scope="module")
def imported() -> dict[str, set[str]]:
    """Packages that are imported after each stage."""
    code = "import json, sys; found = {}\n" + "".join(
        f"import {modules}; found[{modules!r}] = sorted({{name.partition('.')[0] for name in sys.modules}})\n"
        for modules in STAGES
    )
    code += "print(json.dumps(found))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return {modules: set(found) for modules, found in json.loads(done.stdout).items()}


@pytest.mark.parametrize("modules", STAGES)
def test_an_import_loads_nothing_that_only_a_later_stage_needs(modules: str, imported: dict[str, set[str]]) -> None:
    assert modules.partition(".")[0].partition(",")[0] in imported[modules]
    assert not STAGES[modules] & imported[modules]


def test_the_kernel_is_loaded_without_what_it_does_not_need_which_is_found_when_it_is_needed() -> None:
    """Linear algebra for numba's compiled functions, and packages that numba only looks for."""
    code = (
        "import sys, sim.kernel.compiled, sim.kernel.steps; hidden = 'cffi', 'coverage', 'yaml'\n"
        "assert not [name for name in sys.modules if name.partition('.')[0] in hidden]\n"
        "import coverage\n"
        "assert 'numba' in sys.modules and 'scipy.linalg' not in sys.modules\n"
        "import numba, numpy as np\n"
        "product = numba.njit(lambda x: (x @ x, np.cov(x)))\n"
        "x = np.array([[1.0, 2.0], [3.0, 5.0]])\n"
        "assert np.array_equal(product(x)[0], x @ x) and np.allclose(product(x)[1], np.cov(x))\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
