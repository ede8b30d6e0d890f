"""Earthquake records: read from files of every usual format, measured, or made synthetically."""
