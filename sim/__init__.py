"""The physics of the bench: specimen, table and sensors as equations.

Knows no instrument, file, screen or protocol. Importing this package compiles nothing;
`sim.kernel` holds the compiled functions and is imported by the part that runs them.
"""
