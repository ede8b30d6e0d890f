"""The operator's window: an equal client of the engine beside the command line."""
