"""The report of a seismic campaign from a file made by hand: gains, statement, and what is said of missing plays."""

import json
from pathlib import Path

import numpy as np
import pytest

from bench.config.model import BenchConfiguration
from bench.events import PointFinished, RunningGain, Warned
from bench.publication.campaign import Campaign
from bench.publication.conditions import limits_section
from bench.publication.played import played_records
from bench.publication.seismic import seismic_section
from bench.record.reader import open_record
from bench.record.recorder import Recorder
from bench.record.tables import Column
from bench.report.page.document import Listing, Picture, Table
from drivers.rig import Channel
from protocols.earthquake.parameters import EarthquakeParameters
from protocols.earthquake.point import EarthquakePoint, PointStatus

NAME = "synthetic pacoima"
NAMES = ("table_displacement", "table_acceleration", "laser_1", "laser_2")


def point(beta: float, alpha_2: float | None) -> EarthquakePoint:
    if alpha_2 is None:
        lost = {"status": PointStatus.OVERTURNED, "overturned_s": 6.5, "reason": "the block overturned"}
        return EarthquakePoint.model_validate({"record": NAME, "beta": beta, "pga_target_m_s2": 1.4715, **lost})
    return EarthquakePoint(
        record=NAME,
        beta=beta,
        status=PointStatus.MEASURED,
        alpha_2=alpha_2,
        alpha_2_uncertainty=0.012,
        alpha_2_predicted=alpha_2 + 0.01,
        alpha_2_low=alpha_2 - 0.1,
        alpha_2_high=alpha_2 + 0.1,
        agrees=True,
        pga_target_m_s2=1.4715,
    )


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("seismic") / "made.h5"
    configuration = BenchConfiguration()
    parameters = EarthquakeParameters(records=("synthetic:pacoima",), table_band="1.5:25")
    channels = tuple(Channel(name, "displacement", "m", 1e-6, 0.0, (-32768, 32767), "made") for name in NAMES)
    betas = np.array([0.1, 0.25, 0.5])
    prediction = {
        "record": Column(np.array([NAME] * 3), "", "name"),
        "beta": Column(betas, "1", "stiffness ratio"),
        "alpha_2": Column(np.array([0.9, 0.8, np.nan]), "1", "gain"),
    }
    recorder = Recorder(
        path,
        channels=channels,
        sample_rate=2000.0,
        point_type=EarthquakePoint,
        metadata={
            "protocol": "earthquake",
            "parameters": parameters.model_dump_json(),
            "configuration": configuration.model_dump_json(),
            "specimen": configuration.specimen.model_dump_json(),
            "devices": json.dumps({"backend": "hardware"}),
        },
        tables={"prediction": prediction},
    )
    recorder(Warned(61.5, "the table's temperature is near its limit"))
    # a gain that was told although no sample came: nothing was played
    recorder(RunningGain(1.0, NAME, 0.25, 1.0, 0.01, 0.8, 0.8))
    recorder(PointFinished(2.0, point(0.64, None)))
    recorder(PointFinished(3.0, point(0.25, 0.812)))
    recorder.close("stopped", "the operator asked for it")
    return path


def test_gains_statement_and_curves_stand_in_the_section(file: Path) -> None:
    with open_record(file) as record:
        section = seismic_section(Campaign(file, record))
        assert played_records(record) == []
    tables = [part for part in section.parts if isinstance(part, Table)]
    gains, _, _, statement = tables
    assert [row[1] for row in gains.rows] == ["0.25", "0.64"]
    assert gains.rows[0][3] == "0.812 ± 0.012"
    assert gains.rows[0][5] == "0.712 to 0.912"
    assert gains.rows[1][2:4] == ["overturned", "–"]
    assert "1.5 to 25 Hz" in statement.caption
    measured = next(row for row in statement.rows if row[0] == "measured")
    assert measured[1:4] == ["holds", "0.812", "does not hold"]
    (picture,) = [part for part in section.parts if isinstance(part, Picture)]
    assert {panel.get_xlabel() for panel in picture.figure.axes if panel.get_title(loc="left")} == {r"$\beta$"}
    assert any(isinstance(part, Listing) and "0.64: the block overturned" in part.items[0] for part in section.parts)


def test_an_end_before_its_time_and_warnings_are_told(file: Path) -> None:
    with open_record(file) as record:
        section = limits_section(Campaign(file, record))
    said = " ".join(str(part) for part in section.parts)
    assert "stopped" in said
    assert "1:01.5 min  the table's temperature is near its limit" in said
