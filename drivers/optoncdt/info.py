"""Who a sensor says it is."""

import re
from dataclasses import dataclass

COMMAND = "GETINFO"


@dataclass(frozen=True)
class SensorInfo:
    """The identity of a sensor; `measuring_range` in m."""

    model: str
    serial: str
    measuring_range: float
    firmware: str
    article: str
    option: str

    @property
    def supported(self) -> bool:
        """True for the sensors whose commands and scaling this driver knows."""
        return re.match(r"ILD\s?1420\b", self.model, re.IGNORECASE) is not None

    @property
    def identity(self) -> str:
        """Model, measuring range, serial number and firmware in one line."""
        return f"{self.model}, {self.measuring_range * 1e3:g} mm, serial number {self.serial}, firmware {self.firmware}"


def info_in(lines: list[str]) -> SensorInfo | None:
    """The identity in the lines that answer `GETINFO`; None when they do not name a sensor and its range.

    Source: manual, p. 97: one `key: value` per line, the range with its unit.
    """
    pairs = (line.split(":", 1) for line in lines if ":" in line)
    given = {key.strip().lower(): value.strip() for key, value in pairs}
    measuring_range = re.match(r"(\d+(?:\.\d+)?)\s*mm\b", given.get("measuring range", ""), re.IGNORECASE)
    if not given.get("name") or measuring_range is None:
        return None
    serial, firmware, article, option = (given.get(key, "") for key in ("serial", "version", "article", "option"))
    return SensorInfo(given["name"], serial, float(measuring_range[1]) / 1e3, firmware, article, option)
