"""Measurements that are run by hand: they print numbers and need more time than a test may take."""

import os

# several processes, each with as many threads of BLAS as processors, take ten times as long
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
