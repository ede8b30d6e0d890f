"""The bench in the laboratory: DAQ and lasers as one rig."""
