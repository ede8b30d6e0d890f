"""The bench's configuration: one TOML file, validated, every key with its unit."""
