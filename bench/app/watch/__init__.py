"""The live page: a read-only web page of the run under way on this computer."""
