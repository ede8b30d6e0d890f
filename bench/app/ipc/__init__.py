"""Session process and its clients: a run continues or ramps out when a window closes, freezes or crashes."""
