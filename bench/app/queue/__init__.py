"""Queue of tests in a file, which the command line and the window can run."""
