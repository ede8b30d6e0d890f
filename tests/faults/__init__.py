"""Every fault in every state of the engine, on the virtual bench; `tests/benchmarks/faults.py` prints the table."""
