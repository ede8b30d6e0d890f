"""The one decorator that compiles the kernel, so that its rules are the same everywhere.

Signatures are explicit: a function is compiled once, when its module is imported, and kept in numba's cache.
`nogil` lets a thread pool run many simulations; division by zero gives inf, as in numpy, and is caught by the
integrator's check of its state. There is no fastmath: it would make results depend on the processor and break
the test for non-finite numbers. Nobody calls them as C functions: without that wrapper they compile faster.
"""
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportPrivateImportUsage=false, reportAttributeAccessIssue=false
# numba publishes no types; `cast` below gives the decorated function its own type back.

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

# the loops here are short recurrences: vectorising them and the last level of optimisation cost a fifth of the
# time of compilation and win nothing. numba reads these once, when it is imported; who sets them himself is obeyed
for name, value in (("NUMBA_OPT", "2"), ("NUMBA_LOOP_VECTORIZE", "0"), ("NUMBA_SLP_VECTORIZE", "0")):
    os.environ.setdefault(name, value)

import numba  # noqa: E402

F = TypeVar("F", bound=Callable[..., Any])


def _cache_directory() -> str:
    """A cache directory that changes with any source of the kernel.

    numba looks only at the file of the function itself: a caller in another file would go on with the old callee.
    """
    here = Path(__file__).parent
    sources = b"".join(path.read_bytes() for path in sorted(here.glob("*.py")))
    return str(here / "__pycache__" / hashlib.sha256(sources).hexdigest()[:12])


if not numba.config.CACHE_DIR:
    numba.config.CACHE_DIR = _cache_directory()


def inlined(function: F) -> F:
    """Write a thin function out in each compiled caller; on its own it is compiled only when Python calls it.

    Every level of calls between compiled functions costs seconds of compilation, because each is optimised anew.
    """
    return cast(F, numba.njit(cache=True, nogil=True, error_model="numpy", inline="always")(function))


def compiled(signature: str) -> Callable[[F], F]:
    """Compile a function for one numba `signature`, for example ``"float64(float64[::1])"``."""
    decorator = cast(Any, numba.njit)(signature, cache=True, nogil=True, error_model="numpy", no_cfunc_wrapper=True)
    return cast(Callable[[F], F], decorator)
