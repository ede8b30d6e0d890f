"""Free decays of the frame: pulses, fits and what follows from them, as stages of any protocol."""
