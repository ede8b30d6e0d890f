"""Synthetic ground motions with the main numbers of the paper's seven records, for machines that have no records."""

from bench.accelerograms.synthetic.motion import DEFAULT_SEED, synthetic_record
from bench.accelerograms.synthetic.shapes import NAMES, SHAPES, Pulse, Shape

__all__ = ["DEFAULT_SEED", "NAMES", "SHAPES", "Pulse", "Shape", "synthetic_record"]
