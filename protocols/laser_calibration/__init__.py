"""Both lasers held against one motion: the frame locked, the table moving slowly."""
