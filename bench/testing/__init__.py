"""Test tools for plug-ins: rig conformance, a loop-back rig, and a bench for plans. Does not depend on pytest."""
