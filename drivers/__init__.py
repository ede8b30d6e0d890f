"""Instruments: the rig interface (`drivers.rig`), simulated and hardware rigs, and device drivers."""
