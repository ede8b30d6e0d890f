"""Physics of the bench: equations of specimen, table and sensors.

Independent of instruments, files, screens and protocols. Importing this package compiles nothing: the modules that run
compiled functions import them from `sim.kernel` when needed.
"""
