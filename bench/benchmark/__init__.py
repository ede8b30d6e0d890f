"""Run time against error, and the cost of what the software does, measured and written down."""
