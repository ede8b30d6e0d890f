"""Reports on a campaign, from its data file, and on the paper, from simulation."""
