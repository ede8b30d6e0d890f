"""Support of an installation: checks of the machine, and the collection of a fault report."""
