"""Export of recorded campaigns for other programs: MATLAB, CSV, Universal File Format and Parquet."""
