# pyright: reportUnknownMemberType=false
"""A figure that is laid out without being drawn is the same as matplotlib's."""

from io import BytesIO

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from bench.figures.saved_figure import SavedFigure


def _file(kind: type[Figure]) -> bytes:
    # tick labels, legend, title and fixed aspect change the places of the panels
    figure = kind(figsize=(4.0, 3.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot([0.0, 1e5], [0.0, 1e-5], label="a curve")
    right.imshow(np.eye(3))
    right.set_title("a title\nof two lines")
    figure.legend(loc="outside lower center")
    file = BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": "a figure"}):
        figure.savefig(file, format="svg", metadata={"Date": None})
    return file.getvalue()


def test_it_is_saved_as_a_figure_of_matplotlib() -> None:
    assert _file(SavedFigure) == _file(Figure)
