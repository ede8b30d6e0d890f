"""Session process and its clients: when a window closes, freezes or crashes, a run continues or ramps out."""
