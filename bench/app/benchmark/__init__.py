"""Benchmarks of the engine: run time against error, and cost of the program's tasks."""
