"""Sets the twin beside an engine, where the configuration wants one."""

from collections.abc import Generator
from contextlib import contextmanager

from bench.config.model import BenchConfiguration
from bench.engine.requests import Requests
from bench.engine.stream import Stream
from drivers.rig import Rig

BEHIND = "the twin did not keep up, and is off until the rig is armed again"
"""What a warning begins with that depends on how fast the computer was."""


@contextmanager
def twin_beside(
    stream: Stream,
    rig: Rig,
    configuration: BenchConfiguration,
    requests: Requests,
    *,
    patient: bool,
) -> Generator[None]:
    """Within, the twin hears the engine's `stream` after all others and speaks on it; see `bench.twin.twin.Twin`."""
    if not configuration.twin.enabled:
        yield
        return
    from bench.twin.twin import Twin

    twin = Twin(rig.sample_rate, configuration, stream.publish, requests, patient=patient)
    stream.join(twin)
    try:
        yield
    finally:
        twin.close()
