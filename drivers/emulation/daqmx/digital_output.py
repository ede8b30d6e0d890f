"""Digital output tasks: lines that are set when they are written."""

from collections.abc import Sequence

from nidaqmx.error_codes import DAQmxErrors

from drivers.emulation.daqmx.errors import DaqmxFailure
from drivers.emulation.daqmx.line_task import LineChannel, LineTask


class DigitalOutput(LineTask):
    """A `Job` without clock."""

    @property
    def outputs(self) -> list[LineChannel]:
        """Its channels."""
        return self._made

    def write(self, levels: Sequence[bool]) -> None:
        """Set all lines, in order. Raises DaqmxFailure when there are more or fewer levels, or the watchdog bars it."""
        if len(levels) != len(self.all_lines):
            raise DaqmxFailure(
                DAQmxErrors.NUM_LINES_MISMATCH_IN_READ_OR_WRITE,
                f"Number of levels does not match the lines.\n\nLevels: {len(levels)}\nLines: {len(self.all_lines)}",
            )
        for line, high in zip(self.all_lines, levels, strict=True):
            self._lines.write(line.device, line.name, high)

    @property
    def levels(self) -> tuple[bool, ...]:
        """The lines as they are."""
        return tuple(self._lines.is_high(line.name) for line in self.all_lines)
