"""Compiled functions of the comparators, which use the equations of `sim.kernel`."""
