"""The command line, a client of the engine with the same functions as the window."""
