"""Stiffness and damping of the frame from a free decay: the exact linear response fitted to the laser signals."""
