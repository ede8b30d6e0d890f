"""Emulated instruments that use the real wire protocols and are connected to the virtual bench."""
