"""Digital input tasks: lines that are looked at when they are read."""

from drivers.emulation.daqmx.line_task import LineChannel, LineTask


class DigitalInput(LineTask):
    """A `Job` without clock."""

    @property
    def inputs(self) -> list[LineChannel]:
        """Its channels."""
        return self._made

    def read(self) -> bytes:
        """One byte per line as it is now, channel after channel; a channel with fewer lines is filled up with 0."""
        width = self.lines_per_channel
        return b"".join(
            bytes(self._lines.shows(line.name) for line in channel.lines).ljust(width, b"\0") for channel in self.inputs
        )
