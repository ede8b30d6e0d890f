"""Stages of steady sine tests: calibration, start, control of the amplitude, hold on an orbit, and release."""
