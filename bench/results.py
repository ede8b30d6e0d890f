"""Names of the files of every campaign; figures are named by the protocol."""

FILE, SUMMARY = "campaign.h5", "summary.json"
