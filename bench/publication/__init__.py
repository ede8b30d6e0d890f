"""Reports that a researcher attaches to a paper: of a campaign's file, and of the paper itself from simulation."""
