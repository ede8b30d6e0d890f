"""The experiments: one file each, readable like a lab sheet."""
