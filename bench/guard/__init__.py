"""The guard: nothing reaches the shaker except through it."""
