"""What a person may ask of a running bench, from any thread or signal handler."""

from threading import Event


class Requests:
    """Three ways to end, each stronger than the one before; a request once made is never taken back."""

    def __init__(self) -> None:
        self._stop, self._abort, self._halt = Event(), Event(), Event()

    def stop(self) -> None:
        """Ramp the output out; what was measured is good."""
        self._stop.set()

    def abort(self) -> None:
        """Ramp the output out fast; the run is bad."""
        self._abort.set()

    def halt(self) -> None:
        """Cut the enable line now."""
        self._halt.set()

    @property
    def strongest(self) -> str | None:
        """The strongest request made so far: "halt", "abort", "stop" or None."""
        if self._halt.is_set():
            return "halt"
        if self._abort.is_set():
            return "abort"
        return "stop" if self._stop.is_set() else None
