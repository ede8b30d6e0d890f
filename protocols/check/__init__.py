"""Loop check of a bench: a low-level test of every path from drive to sample before an experiment."""
