"""Emulated laser optoNCDT 1420 on a pseudo-terminal: measuring clock, stream of values, commands and faults."""
