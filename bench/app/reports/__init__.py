"""Reports: of a campaign from its data file, and of the paper from simulation."""
