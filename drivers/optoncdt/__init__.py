"""The laser optoNCDT 1420 of Micro-Epsilon, on its serial line or on its analogue output."""
