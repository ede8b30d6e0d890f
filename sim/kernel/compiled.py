"""The one decorator that compiles the kernel, so that its rules are the same everywhere.

Signatures are explicit: a function is compiled once, when its module is imported, and kept in numba's cache.
`nogil` lets a thread pool run many simulations; division by zero gives inf, as in numpy, and is caught by the
integrator's check of its state. There is no fastmath: it would make results depend on the processor and break
the test for non-finite numbers. Nobody calls them as C functions: without that wrapper they compile faster.
"""
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportPrivateImportUsage=false, reportAttributeAccessIssue=false
# numba publishes no types; `cast` below gives the decorated function its own type back.

import os
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

# the loops here are short recurrences: vectorising them and the last level of optimisation cost a fifth of the
# time of compilation and win nothing. numba reads these once, when it is imported; who sets them himself is obeyed
for name, value in (("NUMBA_OPT", "2"), ("NUMBA_LOOP_VECTORIZE", "0"), ("NUMBA_SLP_VECTORIZE", "0")):
    os.environ.setdefault(name, value)

import llvmlite  # noqa: E402
import numba  # noqa: E402
import numpy as np  # noqa: E402

from sim.kernel.cache import KERNEL, KernelCache  # noqa: E402

F = TypeVar("F", bound=Callable[..., Any])

OPTIONS = ("OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "BOUNDSCHECK", "DEBUGINFO_DEFAULT", "DISABLE_INTEL_SVML")
"""numba's settings that change the compiled code and are not in the key of its own index, as the processor is."""

_SETTINGS = [(option, str(getattr(numba.config, option, None))) for option in OPTIONS]
_VERSIONS = [numba.__version__, llvmlite.__version__, np.__version__, *_SETTINGS, __debug__]
_GIVEN = cast(str, numba.config.CACHE_DIR)
_cache = KernelCache(_GIVEN, _VERSIONS)
_caches = {KERNEL: _cache}
_one_at_a_time = threading.RLock()


def inlined(function: F) -> F:
    """Write a thin function out in each compiled caller; on its own it is compiled only when Python calls it.

    Every level of calls between compiled functions costs seconds of compilation, because each is optimised anew.
    """
    return cast(F, numba.njit(nogil=True, error_model="numpy", inline="always")(function))


def compiled(signature: str) -> Callable[[F], F]:
    """Compile a function for one numba `signature`, for example ``"float64(float64[::1])"``."""

    def decorate(function: F) -> F:
        with _one_at_a_time:
            cache = _cache_of(function)
            folder = cache.folder()
            if folder is not None:
                # numba reads this once for each function; it is set for ours only, and other code keeps its caches
                before, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(folder)
                try:
                    made = _njit(signature, function, cache=True)
                    if _is_within(made, folder):
                        return made
                    cache.give_up(f"numba cannot or may not use {folder}")
                except numba.core.errors.NumbaError:
                    raise
                except Exception as error:
                    # a file that a power cut left empty, a full disk: reading and writing pickles raises what it likes
                    cache.give_up(f"{folder} cannot be used ({type(error).__name__}: {error}), remove it")
                finally:
                    numba.config.CACHE_DIR = before
            return _njit(signature, function, cache=False)

    return decorate


def is_compiled(module: str) -> bool:
    """Whether the cache holds compiled code of `module` of the kernel, such as "rocking"."""
    folder = _cache.folder()
    return folder is not None and any(folder.rglob(f"{module}.*.nbi"))


def _is_within(made: Callable[..., Any], folder: Path) -> bool:
    # where numba finds the folder unusable, as on a disk that is full, it goes on to others without a word; without
    # compilation (NUMBA_DISABLE_JIT) there is no cache
    stats = getattr(made, "stats", None)
    return stats is None or Path(stats.cache_path).is_relative_to(folder)


def _cache_of(function: Callable[..., Any]) -> KernelCache:
    """The cache for the folder of a function; one outside the kernel calls it, and has its hash in the name."""
    folder = Path(function.__code__.co_filename).parent
    if folder not in _caches:
        _caches[folder] = KernelCache(_GIVEN, [*_VERSIONS, _cache.name], folder)
    return _caches[folder]


def _njit(signature: str, function: F, *, cache: bool) -> F:
    decorator = cast(Any, numba.njit)(signature, cache=cache, nogil=True, error_model="numpy", no_cfunc_wrapper=True)
    return cast(F, decorator(function))
