"""Who does the handwork at the bench: a person, or an emulated laboratory that is told of it."""

from drivers.laboratory_client import ask, place_of
from drivers.rig import Handwork


class Person:
    """The person at the bench, who has done the work when the rig hears of it."""

    def do(self, work: Handwork, amount: float | None) -> None:
        """Nothing is left to do."""


class RemoteHands:
    """An emulated laboratory at `address`, `host:port`. Raises InvalidInput for anything else."""

    def __init__(self, address: str) -> None:
        place_of(address)
        self._address = address

    def do(self, work: Handwork, amount: float | None) -> None:
        """Have it done to the virtual specimen. Raises RigError, ConnectionLost or DeviceTimeout."""
        ask(self._address, "handwork", work=work.value, amount=amount)
