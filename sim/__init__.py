"""Physics of the bench: equations of specimen, table and sensors.

Independent of instruments, files, screens and protocols. Importing this package compiles nothing;
`sim.kernel` holds the compiled functions and is imported by the part that runs them.
"""
