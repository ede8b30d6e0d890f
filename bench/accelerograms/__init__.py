"""Earthquake records: readers for all common file formats, intensity measures, synthetic records."""
