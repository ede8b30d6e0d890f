"""The command line, a client of the engine with the same standing as the window."""
