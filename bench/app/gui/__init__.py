"""The operator's window, a client of the session with the same functions as the command line."""
