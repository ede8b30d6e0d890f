"""The command line, a client of the engine on a par with the window."""
