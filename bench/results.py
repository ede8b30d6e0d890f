"""Names of the files that every campaign writes. The names of its figures are defined by the protocol."""

FILE, SUMMARY = "campaign.h5", "summary.json"
