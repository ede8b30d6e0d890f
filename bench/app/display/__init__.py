"""Contents of the run displays, independent of Qt: declared once for the window and the live page."""
