"""Measures speed and error: the whole benchmark, or what is asked for.

    python tests/benchmarks/run.py [--quick] [--out DIR]

The same as `rockbench benchmark`, for a checkout without the command installed.
"""

import sys

from bench.app.cli.main import main

if __name__ == "__main__":
    sys.exit(main(["benchmark", *sys.argv[1:]]))
