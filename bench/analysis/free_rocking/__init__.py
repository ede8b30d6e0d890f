"""Free rocking of a block, measured by a laser: restitution from the amplitudes and from the whole motion."""
