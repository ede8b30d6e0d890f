"""The command line: an equal client of the engine."""
