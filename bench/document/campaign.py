"""Contents of a campaign's data file for its report."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, cast

from bench.config.model import BenchConfiguration
from bench.config.validation import dotted, validated
from bench.datafile.checksums import Integrity
from bench.datafile.reader import DataFile
from sim.errors import InvalidInput
from sim.knowledge import SpecimenKnowledge, SpecimenUncertainty
from sim.parameters import Parameters
from sim.specimen import Specimen

AMPLITUDE_FACTOR = 1.01
"""Amplitude A_s of the sine in the paper (Eq. 11), divided by g/lambda."""


@dataclass(frozen=True, eq=False)
class Campaign:
    """An open data file and its path.

    `parameters_type` declares the parameters of the file's protocol; None if the protocol is not installed.
    """

    path: Path
    record: DataFile
    parameters_type: type[Parameters] | None = None

    @cached_property
    def protocol(self) -> str:
        """Name of the protocol; empty if the file has none."""
        return self.record.metadata.get("protocol", "")

    @cached_property
    def parameters(self) -> dict[str, Any]:
        """Parameters of the protocol."""
        return self._json("parameters")

    @cached_property
    def points(self) -> list[dict[str, Any]]:
        """Rows of the results; absent values are None."""
        rows = self.record.points
        return [{name: None if value != value else value for name, value in row.items()} for row in rows]

    @cached_property
    def integrity(self) -> Integrity:
        """Result of the comparison of every dataset with its checksum; reads the whole file."""
        return self.record.integrity(None)

    @cached_property
    def harmonic_points(self) -> list[dict[str, Any]]:
        """Points of steady sine tests, in ascending order of stiffness ratio, then of frequency."""
        found = [row for row in self.points if "omega_rad_s" in row and "alpha_2" in row]
        return sorted(found, key=lambda row: (row["beta"], row["omega_rad_s"]))

    @cached_property
    def seismic_points(self) -> list[dict[str, Any]]:
        """Points of earthquake records, grouped by record, in ascending order of stiffness ratio."""
        found = [row for row in self.points if "record" in row and "alpha_2" in row]
        order = list(dict.fromkeys(row["record"] for row in found))
        return sorted(found, key=lambda row: (order.index(row["record"]), row["beta"]))

    @cached_property
    def amplitude_factor(self) -> float:
        """Amplitude of the sine divided by g/lambda; that of the paper if the protocol has no such parameter."""
        factor = self.parameters.get("amplitude_factor")
        return float(factor) if isinstance(factor, int | float) else AMPLITUDE_FACTOR

    @cached_property
    def specimen(self) -> Specimen:
        """The specimen of the predictions. Raises InvalidInput if the file has none or an invalid one."""
        if "specimen" not in self.record.metadata:
            raise InvalidInput("record", str(self.path), "the file has no specimen, so a prediction is impossible")
        return validated(Specimen, self._json("specimen"), lambda where: f"{self.path.name}: specimen.{dotted(where)}")

    @cached_property
    def uncertainty(self) -> SpecimenUncertainty:
        """Half widths of the uncertainty intervals of the specimen's parameters; the default values if this version
        cannot read the configuration.
        """
        return SpecimenUncertainty() if self.configuration is None else self.configuration.uncertainty

    @cached_property
    def known(self) -> SpecimenKnowledge:
        """The specimen's properties with their uncertainty, for steady motions on the table of the recorded bench."""
        return SpecimenKnowledge() if self.configuration is None else self.configuration.known_on_table

    @cached_property
    def configuration(self) -> BenchConfiguration | None:
        """Configuration of the bench; None if this version cannot read it."""
        try:
            return validated(BenchConfiguration, self._json("configuration"))
        except InvalidInput:
            return None

    @cached_property
    def devices(self) -> Mapping[str, Any]:
        """Devices of the bench, as recorded at the start of the run."""
        return self._json("devices")

    def _json(self, name: str) -> dict[str, Any]:
        try:
            found = json.loads(self.record.metadata.get(name, "{}"))
        except json.JSONDecodeError as error:
            raise InvalidInput(
                "record", str(self.path), f"the entry {name!r} of the file is not valid JSON: {error}"
            ) from None
        return cast(dict[str, Any], found) if isinstance(found, dict) else {}
