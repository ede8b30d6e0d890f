"""Which sensor is steady: against motions whose change from cycle to cycle is known."""

from dataclasses import replace
from itertools import pairwise
from math import tau
from pathlib import Path

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from bench.app.gui.steadiness import MARKS, NEEDED, SensorSteadiness, SteadyView
from bench.app.ipc.messages import TRACES, Traces
from protocols.harmonic.protocol import HarmonicParameters
from tests.bench.app.ipc.experiment import order

STEP, OMEGA, TOLERANCE = 0.002, 16.0, 0.002
PERIOD = tau / OMEGA
TABLE = 5e-3
"""Amplitude of the table [m]."""


def _blocks(
    seconds: float, run: int = 1, begin: float = 0.3, noise: float = 0.0, *, beside_table: bool = False
) -> list[Traces]:
    """Table steady, the first laser going to its amplitude by 2 % a cycle, the second steady over two cycles."""
    n = round(seconds / STEP)
    time = begin + STEP * (np.arange(n) + 0.5)
    wave = np.sin(OMEGA * time)
    decay = 0.98 ** ((time - begin) / PERIOD)
    values = np.zeros((n, len(TRACES)))
    lasers = (1e-3 * wave * (1.0 + 0.5 * decay), 1e-3 * (wave + 0.4 * np.sin(0.5 * OMEGA * time)))
    carried = TABLE * wave if beside_table else 0.0
    shapes = {
        "acceleration": 1.2 * wave,
        "displacement": TABLE * wave,
        "u1": lasers[0] - carried,
        "u2": lasers[1] - carried,
    }
    for name, shape in shapes.items():
        values[:, TRACES.index(name)] = shape
    values[:, TRACES.index("displacement")] += noise * np.random.default_rng(1).normal(size=n)
    cuts = [*range(0, n, 50), n]
    return [
        Traces(run, begin + STEP * first, STEP, part.astype(np.float32), part.astype(np.float32), 0.0)
        for first, last in pairwise(cuts)
        if len(part := values[first:last])
    ]


def _judged(blocks: list[Traces], *, beside_table: bool = False) -> SensorSteadiness:
    judged = SensorSteadiness(OMEGA, TOLERANCE, 0.0, beside_table=beside_table)
    for block in blocks:
        judged.add(block)
    return judged


@pytest.mark.parametrize("beside_table", [False, True])
def test_each_sensor_is_judged_by_itself(beside_table: bool) -> None:
    blocks = _blocks((NEEDED + 2) * PERIOD, noise=0.0 if beside_table else 1e-5, beside_table=beside_table)
    judged = _judged(blocks, beside_table=beside_table)
    assert judged.cycles in (NEEDED + 1, NEEDED + 2)
    acceleration, displacement, first, second = judged.judge()
    assert acceleration.steady
    assert displacement.steady
    assert not first.steady
    # between the means of two windows of 12 cycles, by the geometric series; relative to the later one
    means = [1.0 + 0.5 * np.mean(0.98 ** (np.arange(12.0) + start + judged.cycles - NEEDED)) for start in (0, 12)]
    assert first.drift == pytest.approx((means[0] - means[1]) / means[1], rel=0.05)
    assert (second.steady, second.repeats, judged.alternates(second)) == (False, 2, True)


def test_a_transient_that_is_over_is_steady() -> None:
    first = _judged(_blocks(320 * PERIOD)).judge()[2]
    assert first.steady


def test_a_storey_that_stands_almost_still_is_judged_on_the_other() -> None:
    """A change of 1 % of a laser that moves a hundredth of the other is a change of 0.04 % of a quarter of that."""
    blocks = []
    for block in _blocks((NEEDED + 2) * PERIOD):
        values = block.low.copy()
        time = block.begin + STEP * (np.arange(len(values)) + 0.5)
        values[:, TRACES.index("u2")] = 1e-3 * np.sin(OMEGA * time)
        values[:, TRACES.index("u1")] = 1e-5 * np.sin(OMEGA * time) * (1.0 + 0.01 * (time > 0.3 + 14 * PERIOD))
        blocks.append(replace(block, low=values, high=values))
    assert _judged(blocks).judge()[2].steady


@pytest.mark.parametrize("after", [{"run": 2, "begin": 20.0}, {"run": 1, "begin": 20.0}])
def test_what_is_interrupted_is_judged_anew(after: dict[str, float]) -> None:
    judged = _judged([*_blocks((NEEDED + 2) * PERIOD), *_blocks(3.5 * PERIOD, **after)])  # type: ignore[arg-type]
    assert judged.cycles == 3
    assert not any(each.steady for each in judged.judge())


def test_mark_word_and_number_say_the_same(qtbot: QtBot) -> None:
    view = SteadyView()
    qtbot.addWidget(view)
    run = replace(order(Path("never")), parameters=HarmonicParameters(settle_tolerance=TOLERANCE))
    view.begin(run)
    assert view.isHidden()
    tip = view.toolTip()
    assert all(mark in tip for mark in MARKS.values())
    assert tip.endswith("the run ends a dwell by the same criterion, applied to the samples of all sensors together.")
    view.point(OMEGA, 0.4)
    assert run.configuration.laser_reference == "ground"
    view.add(_blocks(4.5 * PERIOD, beside_table=True))
    assert view.labels["laser_1"].text() == f"{MARKS['gathering']} laser 1: 4 of {NEEDED} cycles"
    view.point(OMEGA, 0.4)
    view.add(_blocks((NEEDED + 3) * PERIOD, run=2, beside_table=True))
    said = {name: label.text() for name, label in view.labels.items()}
    assert said["table_displacement"] == f"{MARKS['steady']} table displ.: steady, < 0.01 %"
    assert said["laser_1"].startswith(f"{MARKS['settling']} laser 1: settling, ")
    assert said["laser_2"] == f"{MARKS['repeats']} laser 2: repeats every 2 cycles"
    assert view.labels["table_displacement"].property("level") == "good"
    view.begin(order(Path("never")))
    view.point(OMEGA, 0.4)
    assert view.isHidden(), "a run without sines has nothing to wait for"
