"""Compiled functions of floats and arrays in SI units, without objects or files."""

import os

# the loops here are short recurrences: vectorisation and the highest level of optimisation take a fifth of the compile
# time without benefit. numba reads these variables once, when a module of the kernel first imports it. They are set
# here so that they, and thus the cache, are the same for all modules. Settings made by the user have priority
for _name, _value in (
    ("NUMBA_OPT", "2"),
    ("NUMBA_LOOP_VECTORIZE", "0"),
    ("NUMBA_SLP_VECTORIZE", "0"),
    # otherwise numba highlights thousands of messages that it never shows, one per overload that does not apply
    ("NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING", "1"),
):
    os.environ.setdefault(_name, _value)
