"""The laser optoNCDT 1420 on a pseudo-terminal: its measuring clock, its stream of values, its commands, its faults."""
