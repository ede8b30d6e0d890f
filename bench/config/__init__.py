"""The bench's configuration: one validated TOML file, every key with its unit."""
