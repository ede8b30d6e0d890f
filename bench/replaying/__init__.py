"""Recorded campaigns once more: played through the same engine, and analysed anew."""
