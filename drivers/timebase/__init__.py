"""Time base: alignment of sensors with free-running clocks to the sample clock."""
