"""Compiled functions on floats and arrays: no objects, no files, no units but SI."""

import os

# the loops here are short recurrences: vectorising them and the highest level of optimisation take a fifth of the
# compile time without benefit. numba reads these once, when any module of the kernel imports it first; set here, they
# are the same for all of them, and so is the cache. The user's own settings have priority
for _name, _value in (("NUMBA_OPT", "2"), ("NUMBA_LOOP_VECTORIZE", "0"), ("NUMBA_SLP_VECTORIZE", "0")):
    os.environ.setdefault(_name, _value)
