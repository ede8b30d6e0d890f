"""Contents of the run displays, shared by the window and the live page, and independent of Qt."""
