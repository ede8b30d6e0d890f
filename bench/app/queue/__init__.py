"""Queue of tests in a file, which can be run from the command line and the window."""
