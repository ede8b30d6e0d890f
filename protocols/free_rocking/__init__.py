"""Free rocking: the stand-alone block tilted by hand and let go, a laser on its face."""
