"""Free decays of the frame: pulses, fits and results, shared by several protocols."""
