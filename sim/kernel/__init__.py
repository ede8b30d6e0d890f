"""Compiled functions on floats and arrays: no objects, no files, no units but SI."""
