"""Preflight: forecast of a run and its margins to all limits."""
