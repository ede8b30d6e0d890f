"""Support of an installation: checks of the machine, and collection of fault reports."""
