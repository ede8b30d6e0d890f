"""Live twin of a run. The model is loaded only if the configuration enables it."""

from collections.abc import Generator
from contextlib import contextmanager

from bench.config.model import BenchConfiguration
from bench.engine.interface import EventStream, Requests
from drivers.rig import Rig


@contextmanager
def live_twin(
    stream: EventStream,
    rig: Rig,
    configuration: BenchConfiguration,
    requests: Requests,
    *,
    patient: bool,
) -> Generator[None]:
    """Context manager in which a `Twin` receives the events of `stream` and publishes its estimates there, if the
    configuration enables it.
    """
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
