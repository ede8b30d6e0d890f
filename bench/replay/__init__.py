"""Replay and re-analysis of recorded campaigns with the engine of live runs."""
