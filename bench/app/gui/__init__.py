"""The operator's window, a client of the session with the same standing as the command line."""
