"""Analysis: what the signals say, while they come in and afterwards."""
