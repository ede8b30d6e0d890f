"""The names of what a campaign leaves in its folder."""

FILE, FIGURE, SUMMARY = "campaign.h5", "gain_spectra.png", "summary.json"
