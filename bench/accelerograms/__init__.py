"""Earthquake records: readers for the common file formats, intensity measures and synthetic records."""
