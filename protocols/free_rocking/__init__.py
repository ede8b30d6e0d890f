"""Free rocking: the stand-alone block is tilted and released by hand while a laser measures the motion of its face."""
