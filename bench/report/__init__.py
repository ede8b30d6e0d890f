"""What a person takes away from a campaign: figure, summary, table."""
