"""The loop check of a bench: every path from drive to sample, at low level, before an experiment relies on it."""
