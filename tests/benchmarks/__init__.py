"""Measurements that are run by hand: they print numbers and need more time than a test may take."""
