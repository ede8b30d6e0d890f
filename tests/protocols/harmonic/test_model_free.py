"""A hold without the model of specimen and table on the simulated bench, through engine, guard and sensors."""

from pathlib import Path
from typing import Any

import pytest

from bench.config.model import BenchConfiguration
from bench.control.cycle_identification import EXCITATION, EXCITED
from bench.control.oscillator import Segment
from bench.control.starts import Start
from bench.datafile.reader import open_datafile
from protocols.common.sine.holding import HoldCycle, HoldMap
from protocols.harmonic.approach import PAUSE, with_pause
from protocols.harmonic.campaign import HarmonicCampaign
from protocols.harmonic.protocol import HarmonicParameters
from sim.errors import InvalidInput
from tests.protocols.harmonic.test_holding import point, replayed_and_analysed

pytestmark = pytest.mark.usefixtures("shared_results", "few_specimens", "no_figures")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("model_free") / "run"


@pytest.fixture(scope="module")
def held(folder: Path) -> dict[str, Any]:
    return point(folder, "--model-free")


def test_the_unstable_orbit_is_held_without_a_model(held: dict[str, Any]) -> None:
    assert held["status"] == "held", held["reason"]
    assert held["model_free"] is True
    assert "without a model" in held["reason"]
    assert held["agrees"] is True
    assert held["alpha_2"] == pytest.approx(held["alpha_2_predicted"], rel=0.01)
    assert held["control_share"] < 2e-3
    # the free motion is that of the first start
    assert held["alpha_2"] < 0.1 < held["alpha_2_least"]


def test_the_file_states_excitation_and_identified_maps(held: dict[str, Any], folder: Path) -> None:
    with open_datafile(folder / "campaign.h5") as record:
        cycles, maps = (record.columns_of(each) for each in (HoldCycle, HoldMap))
        texts = [entry.text for entry in record.events]
    # a control is in effect two cycles after the measured one
    assert list(cycles["control"][2:EXCITED]) == pytest.approx([EXCITATION] * (EXCITED - 2), rel=1e-6)
    assert maps["cycle"][0] == EXCITED
    assert maps["modulus"][-1] == pytest.approx(held["table_multiplier"], abs=0.03)
    assert any("holding the motion on its orbit, without a model" in text for text in texts)


def test_the_file_replays_to_the_last_bit_and_its_hold_is_analysed_again(
    held: dict[str, Any], folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert replayed_and_analysed(folder / "campaign.h5", held, capsys)["model_free"] is True


def test_a_second_start_pauses_where_the_orbit_is_stable() -> None:
    start = Start("", (Segment(6.0, 1.2, 22.0), Segment(14.0, 1.2, 15.0), Segment(6.0, 1.0, 15.0)), 0.9)
    segments = with_pause(start, 16.0)
    assert segments == (
        Segment(6.0, 1.2, 22.0),
        Segment(12.0, 1.2, 16.0),
        Segment(PAUSE, 1.0, 16.0),
        Segment(2.0, 1.0, 15.0),
    )
    assert with_pause(start, None) == start.segments
    direct = Start("", (Segment(8.0, 1.0, 15.0),), 0.9)
    assert with_pause(direct, 16.0) == direct.segments


def test_an_authority_below_the_excitation_is_refused() -> None:
    parameters = HarmonicParameters(omega=(15.0,), beta=(0.97,), model_free=True, hold_authority=0.02)
    with pytest.raises(InvalidInput, match="hold_authority"):
        HarmonicCampaign(parameters, BenchConfiguration())
