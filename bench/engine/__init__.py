"""The engine: runs a plan on a rig through the guard; its only output is the stream of events."""
