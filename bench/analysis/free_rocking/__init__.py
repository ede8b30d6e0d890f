"""Free rocking of a block as a laser sees it: restitution from its amplitudes, and from its whole motion."""
