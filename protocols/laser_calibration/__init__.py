"""Calibration of both lasers against a common slow motion of the table with the frame locked."""
