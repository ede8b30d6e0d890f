"""Analysis of the signals, during and after a run."""
