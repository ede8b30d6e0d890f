"""Emulated laser optoNCDT 1420: measuring clock, stream of values, commands and faults."""
