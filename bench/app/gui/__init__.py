"""The operator's window, a client of the session on a par with the command line."""
