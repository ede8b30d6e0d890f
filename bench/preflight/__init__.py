"""Compile, predict, check: what a run will ask of the bench, against everything that bounds it, before it runs."""
