"""What is refused at once: records, a band, a table model or an identification that cannot be on this bench."""

from bench.config.model import BenchConfiguration
from protocols.earthquake.parameters import EarthquakeParameters
from protocols.earthquake.records import shakings
from protocols.earthquake.sources import Sources
from protocols.earthquake.table import identification, stored_table
from protocols.identify.level import planned


def check(parameters: EarthquakeParameters, configuration: BenchConfiguration, sources: Sources | None = None) -> None:
    """Raise InvalidInput; the records are read here, and everything about them is known afterwards."""
    if stored_table(parameters, configuration, sources) is None:
        planned(identification(parameters, configuration), configuration)
    shakings(parameters, configuration, sources)
