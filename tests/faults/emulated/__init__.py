"""Faults on the wire: the real drivers against the emulated laboratory, in real time, held against its truth."""
