"""Seismic campaign of the paper, section 5."""
