"""Tests of the emulated instruments."""
