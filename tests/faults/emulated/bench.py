"""The campaign on an emulated laboratory of its own: real drivers, real wire, real time."""

from contextlib import ExitStack
from pathlib import Path
from typing import Any

from drivers.emulation.laboratory import Laboratory
from drivers.emulation.wiring import Connection
from drivers.hardware.rig import HardwareRig
from tests.faults.bench import Begin, FaultyBench
from tests.faults.emulated.setup import SETTING, shortened
from tests.faults.emulated.witness import Witness
from tests.faults.places import Place
from tests.faults.rig import FaultyRig
from tests.faults.setup import BARE, PARAMETERS


class WiredRig(FaultyRig):
    """The hardware rig on an emulated laboratory. Whether it is armed is asked of the relay, not of the driver."""

    def __init__(self, inner: HardwareRig, laboratory: Laboratory) -> None:
        super().__init__(inner)
        # this rig has real ones
        self.safety = {}
        self._laboratory = laboratory
        self.starts: dict[int, int] = {}
        """Tick of the first sample of every run that was read, by its place in `runs`."""

    @property
    def armed(self) -> bool:
        return self._laboratory.bench.enabled

    def _played(self, n: int) -> None:
        hidden: Any = self._laboratory.daq
        self.starts.setdefault(len(self.runs) - 1, hidden._driver.first_tick)
        super()._played(n)


class WiredBench(FaultyBench):
    """Owns its laboratory; `calls` are those that came to the device server since the fault began.

    `watchdog` and `heartbeat` say what there is that opens the enable chain when the program does not.
    """

    def __init__(
        self,
        path: Path | None,
        place: Place | None = None,
        begin: Begin | None = None,
        connection: Connection = "analogue",
        *,
        watchdog: bool = True,
        heartbeat: bool = True,
    ) -> None:
        with ExitStack() as opened:
            self.laboratory = opened.enter_context(Laboratory(PARAMETERS, BARE, seed=1, connection=connection))
            self.witness = Witness(self.laboratory.bench)
            self.faults: Any = self.laboratory.daq._faults  # pyright: ignore[reportPrivateUsage]
            self.calls: list[str] = []
            self.begun = False
            self._strike, self.faults.strike = self.faults.strike, self._called
            hardware = shortened(self.laboratory, watchdog=watchdog, heartbeat=heartbeat)
            self.wired = WiredRig(HardwareRig(hardware, lead=SETTING.lead), self.laboratory)
            opened.callback(self.wired.close)
            super().__init__(path, place, begin, setting=SETTING, rig=self.wired)
            # from here on the rig is the engine's, and the laboratory that of whoever made this
            opened.pop_all()

    def _called(self, call: str) -> None:
        if self.begun:
            self.calls.append(call)
        self._strike(call)
