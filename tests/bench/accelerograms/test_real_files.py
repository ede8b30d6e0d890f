"""Real files of every format: counts, steps and peaks as their owners state them, in the header or in a list."""

from pathlib import Path

import numpy as np
import pytest

from bench.accelerograms.measures import measures
from bench.accelerograms.reference import RecordReference
from bench.analysis.table_motion import table_motion
from sim.errors import InvalidInput
from tests.bench.accelerograms.real import CAMPAIGN, FORMATS, needed

G = 9.80665
CSMIP_3 = FORMATS / "CSMIP_CE36456_Parkfield_nc1091100.V2"
ERZINCAN = CAMPAIGN / "ERZIKAN_NS_EW_cms2_dt0.005.txt"
EL_CENTRO = CAMPAIGN / "IELC180_oldPEER.AT2"
L_AQUILA = CAMPAIGN / "AQV_20090406_ITACA16837_H2_WE.cor.acc"


@pytest.mark.parametrize(
    ("path", "options", "spelling", "count", "dt", "peak", "digit"),
    [
        # peaks to the digits that the collection's list, or the header of the file, states [m/s2]
        (CAMPAIGN / "RSN77_SFERN_PUL164.AT2", "", "PEER NGA AT2", 4172, 0.01, 1.219 * G, 5e-4 * G),
        (ERZINCAN, "@column=1,unit=cm/s2,dt=0.005", "columns", 4260, 0.005, 0.515 * G, 5e-4 * G),
        (EL_CENTRO, "", "PEER AT2", 4000, 0.01, 0.313 * G, 5e-4 * G),
        (L_AQUILA, "", "ITACA acc", 112600, 0.005, 6.50655236, 5e-8),
        (CAMPAIGN / "RSN1044_NORTHR_NWH360.AT2", "", "PEER NGA AT2", 2000, 0.02, 0.590 * G, 5e-4 * G),
        (CAMPAIGN / "RSN1119_KOBE_TAZ000.csv", "@unit=g", "columns", 4096, 0.01, 0.697 * G, 5e-4 * G),
        (FORMATS / "RSN763_LOMAP_GIL067.AT2", "", "PEER NGA AT2", 7999, 0.005, 0.358 * G, 1e-3 * G),
        (FORMATS / "OpenSeesEx_H-E01140.AT2", "", "PEER AT2", 7807, 0.005, 0.139 * G, 1e-3 * G),
        (
            FORMATS / "ESM_HI.ARS1..HNE.D.20190728.160908.C.ACC.ASC",
            "",
            "ESM ASCII",
            19128,
            0.005,
            0.300022e-2,
            5e-9,
        ),
        (FORMATS / "KNET_AOM0011801241951.NS", "", "K-NET ASCII", 10200, 0.01, 4.954e-2, 5e-6),
        (FORMATS / "CSMIP_58658_chan001.v2", "", "CSMIP V2", 13000, 0.005, 17.433102e-2, 5e-9),
        (CSMIP_3, "@channel=1", "CSMIP V2", 3251, 0.02, 267.957e-2, 5e-6),
        (CSMIP_3, "@channel=up", "CSMIP V2", 3250, 0.02, 94.805e-2, 5e-6),
        (CSMIP_3, "@channel=3", "CSMIP V2", 3250, 0.02, 256.231e-2, 5e-6),
        (FORMATS / "SMC_0111a.smc", "", "SMC, corrected accelerogram", 6001, 0.005, 104.4078e-2, 5e-5),
    ],
    ids=lambda value: value.stem if isinstance(value, Path) else "",
)
def test_count_step_and_peak(
    path: Path, options: str, spelling: str, count: int, dt: float, peak: float, digit: float
) -> None:
    record = RecordReference.parse(f"{needed(path)}{options}").read()
    assert (record.format, record.acceleration.size) == (spelling, count)
    assert record.dt == pytest.approx(dt, rel=1e-12)
    # the sample itself may be rounded as well
    assert record.peak == pytest.approx(peak, abs=1.01 * digit)


@pytest.mark.parametrize(
    ("path", "options", "factor", "first", "last"),
    [
        # read by eye
        (EL_CENTRO, "", G, -0.6403182e-02, 0.9459335e-04),
        (FORMATS / "OpenSeesEx_H-E01140.AT2", "", G, 0.2118690e-02, 0.8600895e-04),
        (FORMATS / "RSN763_LOMAP_GIL067.AT2", "", G, -0.8075668e-03, 0.3362115e-03),
        (ERZINCAN, "@column=2,unit=cm/s2,dt=0.005", 0.01, 1.4237498e-001, -6.5969660),
        (L_AQUILA, "", 1.0, 2.1491800e-07, -4.2390000e-09),
        (FORMATS / "SMC_0111a.smc", "", 0.01, 1.5057, -2.8745e-1),
        (CSMIP_3, "@channel=90 deg", 0.01, -3.038, None),
    ],
    ids=lambda value: value.stem if isinstance(value, Path) else "",
)
def test_the_first_and_the_last_sample(
    path: Path, options: str, factor: float, first: float, last: float | None
) -> None:
    record = RecordReference.parse(f"{needed(path)}{options}").read()
    assert record.acceleration[0] == factor * first
    if last is not None:
        assert record.acceleration[-1] == factor * last


@pytest.mark.parametrize(
    ("path", "options", "word"),
    [
        (FORMATS / "OpenSees_IELC180.DT2", "", "line 3 ="),
        (CSMIP_3, "", "1 (90 DEG), 2 (UP), 3 (0 DEG)"),
        (ERZINCAN, "", "@column="),
        (ERZINCAN, "@column=1", "@dt="),
        (ERZINCAN, "@column=1,dt=0.005", "@unit="),
        (ERZINCAN, "@column=1,dt=0.01,unit=cm/s2", "line 2 ="),
        (CAMPAIGN / "RSN1119_KOBE_TAZ000.csv", "", "@unit="),
        (CAMPAIGN / "RSN1119_KOBE_TAZ000.csv", "@unit=g,dt=0.02", "0.01 s"),
        (CAMPAIGN / "AQV_20090406_ITACA16837.metadata", "", "unrecognised file format"),
    ],
)
def test_what_must_be_given_or_is_refused(path: Path, options: str, word: str) -> None:
    with pytest.raises(InvalidInput) as refusal:
        RecordReference.parse(f"{needed(path)}{options}").read()
    assert word in str(refusal.value)


def test_velocity_as_the_database_computed_it() -> None:
    # the database's list beside the record: PGV 0.403855588 m/s, largest sample
    record = RecordReference.parse(str(needed(L_AQUILA))).read()
    velocity, _ = table_motion(record.acceleration, record.dt)
    assert np.abs(velocity).max() == pytest.approx(0.403855588, abs=1e-9)
    # between samples it is a little more: at most what the sample beside it can miss
    assert 0.0 < measures(record).pgv - np.abs(velocity).max() < record.peak * record.dt / 8.0


def test_displacement_as_the_database_computed_it() -> None:
    # the .DT2 of the same record in cm; it begins with a velocity and a baseline of its own: a parabola
    record = RecordReference.parse(str(needed(EL_CENTRO))).read()
    rows = needed(FORMATS / "OpenSees_IELC180.DT2").read_text().splitlines()[4:]
    published = 0.01 * np.array([float(word) for row in rows for word in row.split()])
    _, displacement = table_motion(record.acceleration, record.dt)
    time = record.dt * np.arange(published.size)
    baseline = np.polyval(np.polyfit(time, published - displacement, 2), time)
    assert np.abs(published - displacement - baseline).max() < 1e-4
    assert np.abs(published).max() > 0.13
