"""Tests in order, kept in a file: command line and window run the same ones."""
