"""The pages of the documentation, executed: commands, files, quoted results and pictures."""
