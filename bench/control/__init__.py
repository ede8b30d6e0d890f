"""Control: the table does what the protocol asks."""
