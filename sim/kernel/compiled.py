"""Decorators that compile the kernel with uniform settings.

Signatures are explicit: a function is compiled once, when its module is imported, and kept in numba's cache.
`nogil` lets a thread pool run many simulations. Division by zero gives inf, as in numpy, which the integrator detects
when it checks its state. fastmath is not used, because it would make results depend on the processor and break the test
for non-finite numbers; products are fused with sums only where the source contains `fma` (`sim.kernel.lanes`).
The wrapper for calls from C is omitted, because it is unused and slow to compile.
"""
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportPrivateImportUsage=false, reportAttributeAccessIssue=false
# numba has no type annotations; `cast` below restores the type of the decorated function.

import importlib
import sys
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np

from sim.kernel.cache import KERNEL, KernelCache


@contextmanager
def _absent(*names: str) -> Generator[None, None, None]:
    """Context manager in which packages cannot be imported unless they have already been imported."""
    modules = cast(dict[str, Any], sys.modules)
    hidden = [name for name in names if name not in modules]
    modules.update(dict.fromkeys(hidden))
    try:
        yield
    finally:
        for name in hidden:
            # another thread may have imported it meanwhile
            if modules.get(name, name) is None:
                del modules[name]


# numba imports these wherever they are installed, a tenth of the time of a short command: cffi for compiled functions
# that call C libraries, of which there are none here, coverage to report what it compiles, yaml for a file of settings
_SETTINGS_FILE = Path(".numba_config.yaml")
with _absent("cffi", "coverage", *([] if _SETTINGS_FILE.exists() else ["yaml"])):
    import llvmlite.binding
    import numba
    import numba.np.linalg
    from numba.extending import register_jitable

    # otherwise imported when the first function is compiled
    importlib.import_module("numba.core.typing.cffi_utils")

F = TypeVar("F", bound=Callable[..., Any])

# signatures with types of tuples cannot be written as strings; the types of numba are untyped
FLOAT: Any = numba.types.float64
INT: Any = numba.types.int64
VOID: Any = numba.types.void
ROW: Any = FLOAT[::1]
GRID: Any = FLOAT[:, ::1]


def _load_array_functions() -> None:
    """Import numba's array functions without scipy.linalg, an eighth of the processor time of a short command.

    numba imports it only to check for a BLAS, once here and again when a compiled function calls one.
    """
    check = numba.np.linalg.ensure_blas
    numba.np.linalg.ensure_blas = lambda: None
    try:
        functions = importlib.import_module("numba.np.arraymath")
    finally:
        numba.np.linalg.ensure_blas = check
    functions.ensure_blas = check


_load_array_functions()

OPTIONS = ("OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "BOUNDSCHECK", "DEBUGINFO_DEFAULT", "DISABLE_INTEL_SVML")
"""numba's settings that change the compiled code but, unlike the processor, are not part of its cache key."""

_SETTINGS = [(option, str(getattr(numba.config, option, None))) for option in OPTIONS]
_VERSIONS = [numba.__version__, llvmlite.__version__, np.__version__, *_SETTINGS, __debug__]
_GIVEN = cast(str, numba.config.CACHE_DIR)
_cache = KernelCache(_GIVEN, _VERSIONS)
_caches = {KERNEL: _cache}
_one_at_a_time = threading.RLock()


def inlined(function: F) -> F:
    """Inline a small function into each compiled caller; it is compiled separately only when Python calls it.

    Each level of calls between compiled functions costs seconds of compilation, because each is optimised separately.
    """
    return cast(F, numba.njit(nogil=True, error_model="numpy", inline="always")(function))


def generic(function: F) -> F:
    """Compile a function inside its compiled callers, once for each type of number passed by them.

    Called from Python, it is interpreted. Without the wrappers for such calls, it compiles faster.
    """
    options = {"nogil": True, "error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return cast(F, cast(Any, register_jitable)(**options)(function))


def compiled(signature: object, *, internal: bool = False) -> Callable[[F], F]:
    """Compile a function for one numba `signature`, for example ``"float64(float64[::1])"``, or an object of numba.

    An `internal` function is called by other compiled functions only: the wrapper for calls from Python is omitted,
    which takes longer to compile than a short function.
    """

    def decorate(function: F) -> F:
        with _one_at_a_time:
            cache = _cache_of(function)
            folder = cache.folder()
            if folder is not None:
                # numba reads this setting for each function; it is changed only for functions compiled here, so that
                # other code keeps its cache
                before, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(folder)
                try:
                    made = _njit(signature, function, cache=True, internal=internal)
                    if _is_within(made, folder):
                        return made
                    cache.give_up(f"numba does not use {folder}")
                except numba.core.errors.NumbaError:
                    raise
                except Exception as error:
                    # after a power failure or on a full disk, reading and writing pickles may raise any exception
                    cache.give_up(f"{folder} cannot be used ({type(error).__name__}: {error}); remove this folder")
                finally:
                    numba.config.CACHE_DIR = before
            return _njit(signature, function, cache=False, internal=internal)

    return decorate


def is_compiled(module: str) -> bool:
    """Whether the cache contains compiled code of the kernel's `module`, such as "rocking"."""
    folder = _cache.folder()
    return folder is not None and any(folder.rglob(f"{module}.*.nbi"))


def cache_folder() -> Path | None:
    """Folder of the compiled kernel, writable by this user only; None where the kernel is compiled in memory."""
    return _cache.folder()


def processor() -> str:
    """Compiler's name for the processor, on which the last digits of the kernel's results depend."""
    return str(llvmlite.binding.get_host_cpu_name())


def _is_within(made: Callable[..., Any], folder: Path) -> bool:
    # if the folder is unusable, as on a full disk, numba silently uses another one; without compilation
    # (NUMBA_DISABLE_JIT) there is no cache
    stats = getattr(made, "stats", None)
    return stats is None or Path(stats.cache_path).is_relative_to(folder)


def _cache_of(function: Callable[..., Any]) -> KernelCache:
    """Cache of the compiled functions of the source folder that contains `function`.

    For sources outside the kernel, the hash in the name of the cache folder also covers the kernel's.
    """
    folder = Path(function.__code__.co_filename).parent
    if folder not in _caches:
        _caches[folder] = KernelCache(_GIVEN, [*_VERSIONS, _cache.name], folder)
    return _caches[folder]


def _njit(signature: object, function: F, *, cache: bool, internal: bool) -> F:
    options = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True, "no_cpython_wrapper": internal}
    return cast(F, cast(Any, numba.njit)(signature, cache=cache, **options)(function))
