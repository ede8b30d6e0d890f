"""Compiled functions of the comparators, on the equations of `sim.kernel`."""
