"""Figures, summary file and text tables of a campaign."""
