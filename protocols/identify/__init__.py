"""The identification of the table: what motion a volt of drive makes at each frequency."""
