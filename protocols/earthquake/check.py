"""What is refused at once: records, a band or a table model that cannot be used on this bench."""

from bench.config.model import BenchConfiguration
from protocols.earthquake.parameters import EarthquakeParameters
from protocols.earthquake.records import shakings
from protocols.earthquake.table import stored_table


def check(parameters: EarthquakeParameters, configuration: BenchConfiguration) -> None:
    """Raise InvalidInput; the records are read here, and everything about them is known afterwards."""
    stored_table(parameters, configuration)
    shakings(parameters, configuration)
