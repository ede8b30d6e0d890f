"""Tells how sensors with clocks of their own were placed on the sample clock, once for each run that is over."""

from bench.engine.stream import Stream
from bench.events import SensorsAligned, Warned
from drivers.rig import Rig
from sim.errors import RockbenchError


class Placements:
    """Asks the rig when a run has ended; most rigs have nothing to tell."""

    def __init__(self, rig: Rig, stream: Stream) -> None:
        self._rig, self._stream = rig, stream
        self._run: int | None = None

    def begin(self, run: int) -> None:
        """The rig has been armed for this run."""
        self._run = run

    def tell(self) -> None:
        """The run is over; telling again tells nothing. A rig that cannot answer is a warning: the run ended well."""
        run, self._run = self._run, None
        if run is None:
            return
        try:
            alignments = self._rig.alignments
        except RockbenchError as error:
            self._stream.publish(Warned(f"how the sensors' clocks ran in run {run} is not known: {error}"))
            return
        if alignments:
            self._stream.publish(SensorsAligned(run, alignments))
