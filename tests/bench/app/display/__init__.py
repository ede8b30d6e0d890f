"""The operator's window, without a screen."""
