"""Support of an installation: checks of the computer, and collection of fault reports."""
