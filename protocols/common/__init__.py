"""Stages that several protocols share; none of them knows which one it serves."""
