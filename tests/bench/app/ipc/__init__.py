"""The link between a session's process and its client."""
