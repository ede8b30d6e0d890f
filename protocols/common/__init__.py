"""Stages shared by several protocols."""
