"""The names of what every campaign leaves in its folder; its figure has the name that the protocol gives it."""

FILE, SUMMARY = "campaign.h5", "summary.json"
