"""The file of a campaign, taken apart for its report."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from bench.config.model import BenchConfiguration
from bench.config.validation import dotted, validated
from bench.record.integrity import Integrity
from bench.record.reader import Record
from sim.errors import InvalidInput
from sim.knowledge import SpecimenKnowledge
from sim.parameters import Parameters
from sim.specimen import Specimen
from sim.uncertainty import SpecimenUncertainty

if TYPE_CHECKING:
    from bench.protocol import Protocol

SETTING = {"frequency": "omega_rad_s", "stiffness": "beta", "record": "record"}
"""Fields of a point that say which test it is."""


@dataclass(frozen=True, eq=False)
class Campaign:
    """An open file and where it lies. `configuration` is None where the file's is not one that this version knows.

    `installed` is the file's protocol, None where it is not installed here.
    """

    path: Path
    record: Record
    installed: "Protocol[Any] | None" = None

    @property
    def asked(self) -> type[Parameters] | None:
        """How the parameters of the file's protocol are declared; None where it is not installed here."""
        return None if self.installed is None else self.installed.parameters

    @cached_property
    def protocol(self) -> str:
        """Which experiment it was; empty where the file does not say."""
        return self.record.metadata.get("protocol", "")

    @cached_property
    def parameters(self) -> dict[str, Any]:
        """What the experiment asked for."""
        return self._json("parameters")

    @cached_property
    def points(self) -> list[dict[str, Any]]:
        """The results, absent values as None."""
        rows = self.record.points
        return [{name: None if value != value else value for name, value in row.items()} for row in rows]

    @cached_property
    def integrity(self) -> Integrity:
        """Every dataset of the file held against its checksum; reads the whole file."""
        return self.record.integrity(None)

    @cached_property
    def harmonic_points(self) -> list[dict[str, Any]]:
        """Those of steady tests under a sine, ascending in stiffness, then frequency."""
        found = [row for row in self.points if SETTING["frequency"] in row and "alpha_2" in row]
        return sorted(found, key=lambda row: (row["beta"], row["omega_rad_s"]))

    @cached_property
    def seismic_points(self) -> list[dict[str, Any]]:
        """Those of earthquake records, by record, then ascending in stiffness."""
        found = [row for row in self.points if SETTING["record"] in row and "alpha_2" in row]
        order = list(dict.fromkeys(row["record"] for row in found))
        return sorted(found, key=lambda row: (order.index(row["record"]), row["beta"]))

    @cached_property
    def specimen(self) -> Specimen:
        """The specimen that the predictions were made for. Raises InvalidInput where the file has none."""
        if "specimen" not in self.record.metadata:
            raise InvalidInput("record", str(self.path), "it says nothing of a specimen, so nothing can be predicted")
        return validated(Specimen, self._json("specimen"), lambda where: f"{self.path.name}: specimen.{dotted(where)}")

    @cached_property
    def uncertainty(self) -> SpecimenUncertainty:
        """What was left open of the specimen; the usual where the file does not say."""
        return SpecimenUncertainty() if self.configuration is None else self.configuration.uncertainty

    @cached_property
    def known(self) -> SpecimenKnowledge:
        """How well the specimen was known, in a steady motion on the file's table."""
        return SpecimenKnowledge() if self.configuration is None else self.configuration.known_on_table

    @cached_property
    def configuration(self) -> BenchConfiguration | None:
        """The bench."""
        try:
            return validated(BenchConfiguration, self._json("configuration"))
        except InvalidInput:
            return None

    @cached_property
    def devices(self) -> Mapping[str, Any]:
        """What the bench consisted of."""
        return self._json("devices")

    def _json(self, name: str) -> dict[str, Any]:
        try:
            found = json.loads(self.record.metadata.get(name, "{}"))
        except json.JSONDecodeError as error:
            raise InvalidInput("record", str(self.path), f"its {name} are not JSON: {error}") from None
        return cast(dict[str, Any], found) if isinstance(found, dict) else {}
