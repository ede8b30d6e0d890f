"""Stiffness and damping of the frame from a free decay, by a fit of the exact linear response to the laser signals."""
