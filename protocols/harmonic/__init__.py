"""Harmonic campaign of the paper, section 4.3."""
