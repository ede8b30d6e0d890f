"""Stiffness of mounted springs, from the shift of the modes of the frame with the block held."""
