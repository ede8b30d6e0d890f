"""Contents of a run display that are derived from the events: verdict, current point, specimen, and last result."""

from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.analysis.uncertainty import COVERAGE
from bench.app.catalogue import load_protocol
from bench.app.display import texts
from bench.app.display.buffers import BlockAngle, Ring
from bench.app.display.status import Arrangement
from bench.app.display.typography import in_screen_unit, spaced, typeset
from bench.app.display.verdict import running_verdict, verdict_of
from bench.app.formatting import measurement
from bench.app.ipc.messages import Run
from bench.document.typography import label
from bench.events import Event, PointFinished, SpecimenMounted, StepStarted
from bench.findings import FitFinished, TableIdentified
from bench.live_values import Estimate, LiveValue, RunningGain
from bench.protocol import Protocol

ROUNDING = 1e-3
"""Half a bin of the traces [s]. A bin that ends within this time after an operator's action belongs to the samples
before it: in virtual time, an action follows the last sample immediately.
"""


class RunContents:
    """Contents of the display of one run.

    protocol : the protocol; None before the first run.
    sentence : the running value or, once there is one, the verdict, in one sentence.
    point : the current or last point.
    arrangement : the specimen on the table, its clamps and the target of laser 2.
    arranged : bench time of the operator's last action [s]; earlier samples belong to another arrangement.
    """

    def __init__(self, run: Run | None = None) -> None:
        self.protocol: Protocol[Any] | None = None if run is None else load_protocol(run.protocol)
        self.sentence = self._nothing
        self.point = ""
        self.arrangement = Arrangement() if run is None else Arrangement.of(run.configuration.known_specimen)
        self.arranged = -inf
        self._has_live_value = self._running = False

    @property
    def has_gain(self) -> bool:
        """Whether the points of the protocol have a gain; True before the first run."""
        return self.protocol is None or "alpha_2" in self.protocol.point.model_fields

    @property
    def _nothing(self) -> str:
        """Sentence before the first result."""
        return texts.NO_GAIN if self.has_gain else texts.NO_RESULT

    def instant(
        self, ring: Ring, block: BlockAngle, moment: float
    ) -> tuple[NDArray[np.float64], tuple[float, float] | None]:
        """Signals and angle of the block at bench time `moment` [s], as returned by `Ring.at` and `BlockAngle.at`;
        zeros and None before the first sample with the present arrangement.
        """
        signals = ring.at(moment)
        return (signals, block.at(moment)) if moment > self.arranged else (np.zeros_like(signals), None)

    def follow(self, event: Event) -> None:
        """Update the contents with an event."""
        match event:
            case Estimate():
                self._show_running(event, _sine(event.omega, event.beta))
            case RunningGain():
                self._show_running(event, _record(event.record, event.beta))
            case StepStarted():
                self.end_step()
            case LiveValue():
                self._has_live_value = True
                self.sentence = running_verdict(event)
            case PointFinished():
                self._finish(event)
            case FitFinished() | TableIdentified() if not self.has_gain:
                self._show_result(event)
            case SpecimenMounted():
                self.arrangement.follow(event)
                self.arranged = event.time + ROUNDING
            case _:
                pass

    def end_step(self) -> None:
        """Remove the running gain of a step that has ended: the motion to which it belongs has ended as well."""
        if self._running:
            self._running, self.point = False, ""
            self.sentence = self._nothing

    def _show_running(self, event: Estimate | RunningGain, place: str) -> None:
        self.point = texts.MEASURING.format(point=place)
        self.sentence, self._running = running_verdict(event, self._nothing), True
        self._couple(event.beta)

    def _finish(self, event: PointFinished) -> None:
        """Show the result of a point, with the same uncertainty as in the log and the data file."""
        if self._running:
            # the point that was being measured has ended
            self._running, self.point = False, ""
        point, protocol = event.point.model_dump(), self.protocol
        if protocol is None:
            return
        if protocol.log_line is not None:
            self.sentence = spaced(protocol.log_line(event.point))
        elif protocol.view.headline or not self._has_live_value:
            # a protocol without a headline keeps its live value as the verdict
            self.sentence = verdict_of(protocol.view, event.point)
        if "alpha_2" not in point:
            return
        omega, beta = point.get("omega_rad_s"), point.get("beta")
        where = _record(point["record"], beta) if "record" in point else "" if omega is None else _sine(omega, beta)
        self.point = texts.LAST_POINT.format(status=point.get("status", ""), point=where)

    def _show_result(self, event: FitFinished | TableIdentified) -> None:
        if isinstance(event, FitFinished) and event.parameters:
            name, found = next(iter(event.parameters.items()))
            factor, unit = in_screen_unit(found.unit)
            value = measurement(factor * found.value, COVERAGE * factor * found.uncertainty, unit)
            self.sentence = f"{label(name)} {value}"
            self.point = f"{typeset(event.name)}: {typeset(event.text)}"
        else:
            self.point = typeset(event.text)

    def _couple(self, beta: float | None) -> None:
        if (beta is not None) != self.arrangement.spring:
            self.arrangement.block = self.arrangement.spring = beta is not None


def _sine(omega: float, beta: float | None) -> str:
    """Name of a point whose motion is a sine."""
    return (texts.BARE_SINE if beta is None else texts.SINE_POINT).format(omega=omega, beta=beta)


def _record(record: str, beta: float | None) -> str:
    """Name of a point whose motion is an earthquake record."""
    return (texts.BARE_RECORD if beta is None else texts.RECORD_POINT).format(record=record, beta=beta)
