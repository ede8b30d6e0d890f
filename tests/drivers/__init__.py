"""Tests of the instruments and of every backend."""
