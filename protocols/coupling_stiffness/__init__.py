"""Stiffness of mounted springs, from the shift of the frame's modes with the block clamped."""
