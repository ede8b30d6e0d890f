"""The bench's configuration: one validated TOML file in SI units."""
