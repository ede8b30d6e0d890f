"""Emulated instruments: the real wire protocols, connected to the virtual bench."""
