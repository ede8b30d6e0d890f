"""Stability: multipliers of rocking orbits from held motions that are released, and the boundary of stability."""
