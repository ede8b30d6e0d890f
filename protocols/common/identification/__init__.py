"""The identification of the table by multisines, as a stage of any protocol."""
