"""Recorded campaigns for other programs: MATLAB, text, Universal File Format, Parquet."""
