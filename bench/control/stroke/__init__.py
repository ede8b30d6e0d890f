"""Fitting a record of ground acceleration into the stroke and the velocity that a table has."""
