"""The seismic campaign of the paper, section 5."""
