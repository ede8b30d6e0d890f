"""Experiments: one protocol per package or module."""
