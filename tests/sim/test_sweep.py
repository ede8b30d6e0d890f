"""Sweeps in threads, on a scheduler with two worker processes, and without one."""

import os
import socket
import sys
import threading
import warnings
from importlib import import_module
from typing import Any

import numpy as np
import pytest

from sim.ensemble import record_gains, steady_gains
from sim.errors import InvalidInput
from sim.excitation import SampledRecord
from sim.extras import MissingExtra
from sim.gain import seismic_curve
from sim.knowledge import SpecimenKnowledge
from sim.map_rows import STRIPS, WIDE
from sim.maps import gain_map
from sim.outcomes import outcome_map
from sim.specimen import Specimen
from sim.steady import rocking_orbit
from sim.sweep import SchedulerUnavailable, connection, in_threads, processors, sweep
from tests.forked import FORKS
from tests.patience import LONG
from tests.sim.runs import A_S


def process(_: int) -> int:
    """The process that did it."""
    return os.getpid()


def inverse(value: int) -> float:
    return 1.0 / value


def test_threads_keep_the_order_and_share_the_work() -> None:
    together = threading.Barrier(2, timeout=10.0)

    def both(value: int) -> int:
        if value < 2 and (os.cpu_count() or 1) > 1:
            together.wait()  # passes only when two run at a time
        return value * value

    assert sweep(both, range(50)) == [value * value for value in range(50)]
    assert sweep(both, []) == []


def test_errors_come_through() -> None:
    with pytest.raises(ZeroDivisionError):
        sweep(inverse, [1, 0])
    with pytest.raises(InvalidInput, match="batch"):
        sweep(inverse, [1], batch=0)


def test_without_the_client_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtra, match=r"tcp://x:1.*rocking-bench\[distributed\]"):
        sweep(inverse, [1], "tcp://x:1")


def test_a_scheduler_that_is_not_there_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed", reason="dask.distributed is not installed (extra: distributed)")
    monkeypatch.setattr("sim.sweep.PATIENCE", 0.5)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    with pytest.raises(SchedulerUnavailable, match=address):
        sweep(inverse, [1], address)


LOADED = ["distributed", "sim.gain", "sim.maps", "sim.outcomes", "sim.kernel.members", "sim.kernel.rocking"]
"""What the workers need: each would take more than a second of processor time to import it."""


@pytest.fixture(scope="module")
def cluster() -> Any:
    """Two workers, forked from a process that has imported what they need; where there is no fork, they do it."""
    distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed (extra: distributed)")
    method = "forkserver" if FORKS else "spawn"
    with (
        warnings.catch_warnings(),
        import_module("dask").config.set({"distributed.worker.multiprocessing-method": method}),
    ):
        context = import_module("distributed.utils").get_mp_context()
        if FORKS:
            context.set_forkserver_preload(LOADED)
        with distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address="127.0.0.1:0", host="127.0.0.1"
        ) as two_workers:
            yield two_workers


def test_a_scheduler_s_workers_do_the_work(cluster: Any) -> None:
    address = str(cluster.scheduler_address)
    seen = sweep(process, range(40), address)
    assert len(set(seen)) == 2
    assert os.getpid() not in seen
    assert sweep(inverse, range(1, 8), address, batch=3) == [1.0 / value for value in range(1, 8)]
    with pytest.raises(ZeroDivisionError):
        sweep(inverse, [1, 0], address)


def test_a_map_is_divided_alike_on_all_computers(cluster: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """So that its orbits do not depend on them; there are strips for both workers, and more of a wide map."""
    strips: list[int] = []

    def counted(function: Any, items: Any, scheduler: str | None, *, done: Any) -> list[Any]:
        strips.append(len(items))
        return sweep(function, items, scheduler, done=done)

    monkeypatch.setattr("sim.map_rows.sweep", counted)
    address, omegas = str(cluster.scheduler_address), np.linspace(14.0, 20.0, 12)
    assert processors(address) == 2
    found = [gain_map(Specimen(), [0.2, 0.6], omegas, A_S, scheduler=address)]
    for number in (1, 64):
        monkeypatch.setattr("os.cpu_count", lambda number=number: number)
        found.append(gain_map(Specimen(), [0.2, 0.6], omegas, A_S))
    assert strips == [STRIPS] * 3
    for other in found[1:]:
        np.testing.assert_array_equal(other.rocking.alpha_2, found[0].rocking.alpha_2)
    gain_map(Specimen(), [0.2], np.linspace(14.0, 20.0, 10 * WIDE), A_S)
    assert strips[-1] == 10


def test_orbits_that_need_a_neighbour_do_not_depend_on_the_processors(monkeypatch: pytest.MonkeyPatch) -> None:
    """At steps of this size, the column at 28 rad/s is continued from its neighbour."""
    found = list[Any]()
    for number in (1, 2, 4):
        monkeypatch.setattr("os.cpu_count", lambda number=number: number)
        found.append(gain_map(Specimen(), np.linspace(0.02, 3.0, 6), np.linspace(20.0, 40.0, 6), A_S).rocking.alpha_2)
    for other in found[1:]:
        np.testing.assert_array_equal(other, found[0])


def test_a_map_and_its_outcomes_are_the_same_on_workers(cluster: Any) -> None:
    address = str(cluster.scheduler_address)
    betas, omegas = [0.2, 0.6, 1.0], np.linspace(14.0, 20.0, 8)
    here, there = gain_map(Specimen(), betas, omegas, A_S), gain_map(Specimen(), betas, omegas, A_S, scheduler=address)
    assert np.array_equal(here.rocking.peaks, there.rocking.peaks)
    assert np.array_equal(here.rocking.multipliers, there.rocking.multipliers)
    first, second = outcome_map(here), outcome_map(there, scheduler=address)
    assert (first.outcome == second.outcome).all()
    assert np.array_equal(first.time, second.time)


def test_bands_scatters_and_seismic_curves_are_the_same_on_workers(cluster: Any) -> None:
    address, specimen = str(cluster.scheduler_address), Specimen(beta=0.4)
    orbit = rocking_orbit(specimen, 16.0, A_S)
    members = SpecimenKnowledge().draws(specimen, 30, np.random.default_rng(1))
    here, there = (steady_gains([orbit], [members], scheduler=each) for each in (None, address))
    assert np.array_equal(here, there, equal_nan=True)
    t = np.arange(0.0, 4.0, 0.01)
    record = SampledRecord(2.2 * np.sin(16.0 * t) * np.sin(np.pi * t / 4.0), 0.01)
    with connection(address):
        here, there = (record_gains(members, record, each) for each in (None, address))
        assert np.array_equal(here, there, equal_nan=True)
        curves = [seismic_curve(Specimen(), record, [0.25, 0.64, 0.97], each) for each in (None, address)]
    gains = [[(gain.alpha_1, gain.alpha_2) for gain in curve] for curve in curves]
    assert gains[0] == gains[1]


def test_sweeps_share_a_connection(cluster: Any) -> None:
    address = str(cluster.scheduler_address)
    with connection(address), connection(address):
        before = len(cluster.scheduler.clients)
        assert sweep(inverse, [1, 2], address) == [1.0, 0.5]
        assert processors(address) == 2
        assert len(cluster.scheduler.clients) == before


def test_an_interrupt_drops_what_has_not_begun_and_waits_for_nothing() -> None:
    begun, ended = list[int](), list[int]()
    free = threading.Event()

    def work(item: int) -> int:
        begun.append(item)
        free.wait(LONG)
        ended.append(item)
        return item

    def interrupt(_done: int, _all: int) -> None:
        raise KeyboardInterrupt

    try:
        with pytest.raises(KeyboardInterrupt):
            in_threads(work, range(100), interrupt, threads=2)
        assert ended == []
    finally:
        free.set()
    assert sorted(begun) == [0, 1]


def test_what_is_done_is_counted_and_stays_in_order() -> None:
    told = list[tuple[int, int]]()
    assert in_threads(inverse, [4, 2, 1], lambda done, of: told.append((done, of))) == [0.25, 0.5, 1.0]
    assert told[-1] == (3, 3)
    with pytest.raises(ZeroDivisionError):
        in_threads(inverse, [1, 0])
