"""The laboratory bench: DAQ and lasers as one rig."""
