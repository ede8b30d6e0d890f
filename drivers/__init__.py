"""Instruments: the interface of a rig (`drivers.rig`), simulated and hardware rigs, device drivers."""
