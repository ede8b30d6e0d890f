"""A session in a process of its own, and its clients: a window that closes, freezes or dies harms no run."""
