"""The session process, which carries out a run, and its clients. If the window closes, freezes or crashes, the run
ramps out, or continues if it was set to do so.
"""
