"""Identification of the table: acceleration per volt of drive against frequency."""
