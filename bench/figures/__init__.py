"""Figures, the summary file and the text tables of a campaign."""
