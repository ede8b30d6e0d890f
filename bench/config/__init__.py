"""The bench's configuration: one validated TOML file in which every key has a unit."""
