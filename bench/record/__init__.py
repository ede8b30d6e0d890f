"""The record: one HDF5 file per campaign."""
