"""Physics of the bench: equations of specimen, table and sensors.

This package is independent of instruments, files, displays and protocols. Importing it compiles nothing: the modules
that run compiled functions import them from `sim.kernel` when needed.
"""
