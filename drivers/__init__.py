"""The instruments: one interface (`drivers.rig`) and every backend behind it."""
