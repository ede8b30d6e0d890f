"""A figure that matplotlib draws once instead of twice when it is saved."""

from contextlib import suppress

from matplotlib.backend_bases import RendererBase
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine


class SavedFigure(Figure):
    """To lay out a figure before it is saved, matplotlib draws all of it without output. This figure is only laid out,
    which places its panels in the same way.
    """

    def draw(self, renderer: RendererBase) -> None:
        """Draw the figure; before it is saved, lay it out."""
        engine = self.get_layout_engine()
        if not (self.canvas.is_saving() and isinstance(engine, ConstrainedLayoutEngine)):
            super().draw(renderer)
        elif self.axes:
            # as in `Figure.draw`
            with suppress(ValueError):
                engine.execute(self)
