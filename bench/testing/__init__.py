"""Test tools for plug-ins: rig conformance, a loop-back rig, and a bench for plans. They do not depend on pytest."""
