"""Identification of the table by multisines, a stage shared by several protocols."""
