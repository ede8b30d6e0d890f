"""One declaration of an event: its columns in the file, its reading, export, comparison in replay, and its lines."""

import json
from dataclasses import replace
from io import StringIO
from pathlib import Path

import h5py  # pyright: ignore[reportMissingTypeStubs]
import numpy as np
import pytest

from bench import events
from bench.app.cli.terminal import PlainLines
from bench.app.export.format import content_of
from bench.app.run_display import RunDisplay, notice_of
from bench.datafile.declared import EVENT_TABLES, counters
from bench.datafile.reader import open_datafile
from bench.datafile.recovery import recover
from bench.datafile.writer import journal_path
from bench.engine.interface import EventStream
from bench.events import Event, SensorsAligned, SpecimenMounted, StepStarted, Warned, event
from bench.findings import TableIdentified
from bench.live_values import LiveValue
from drivers.clock import VirtualClock
from drivers.rig import Alignment, OperatorTask
from sim.errors import InvalidInput
from sim.parameters import column
from sim.specimen import Specimen
from tests.bench.datafile.example import begin, block, record
from tests.command_line import rendered

PERIOD = LiveValue("period", 0.6412, "s", 0.0031, 0.6389, time=3.0)
ALIGNED = SensorsAligned(2, (Alignment("laser_1", 0.1, 1.00003, 2e-6, 0.0035, 4000, 1),) * 2, time=4.0)
LINES = 5
TABLE = TableIdentified("first", *(np.arange(LINES) + k / 7.0 for k in range(7)), time=5.0)


def test_every_column_of_every_event_has_a_meaning_and_numbers_a_unit() -> None:
    assert len(EVENT_TABLES) >= 7
    for kind, table in EVENT_TABLES.items():
        assert (kind.__doc__ or "").strip(), kind
        for field in table.fields:
            assert field.description, (kind, field.name)
            assert (field.unit != "") == (field.kind != "text"), (kind, field.name)


def test_what_files_of_before_counted_keeps_its_place() -> None:
    """`complete` is read by position: the order of the first seventeen is in every file that was ever written."""
    counted = (
        *("samples", "blocks", "events", "estimates", "points", "alignments", "running_gains", "passes"),
        *("table_response", "fits", "fit_columns", "fit_parameters", "fit_values", "twin", "identified"),
        *("identified_correlations", "live_values"),
    )
    assert counters(["own"])[: len(counted)] == counted
    assert counters(["own"])[-1] == "own"


def test_a_live_value_is_recorded_read_and_exported_by_its_declaration(tmp_path: Path) -> None:
    path = tmp_path / "campaign.h5"
    unknown = replace(PERIOD, value=float("nan"), time=2.0)
    record(begin(path), block(0, 10), unknown, PERIOD, ALIGNED, TABLE)
    with open_datafile(path) as kept:
        first, second = kept.rows_of(LiveValue)
        assert np.isnan(first["value"])
        assert second == {name: getattr(PERIOD, name) for name in second}
        assert kept.alignments == {2: ALIGNED.alignments}
        np.testing.assert_array_equal(kept.columns_of(TableIdentified)["noise"], TABLE.noise)
        # journalled: what is not published many times a second
        assert [each.kind for each in kept.events] == ["SensorsAligned", "TableIdentified"]
        tables = content_of(kept, path, raw=False).tables
        assert {"live_values", "alignments", "table_response", "events"} <= tables.keys()
        exported = {column.name: column for column in tables["live_values"]}
        assert (exported["value"].values[1], exported["label"].values[0]) == (PERIOD.value, "period")
        units = {column.name: column.unit for column in tables["table_response"]}
        assert (units["frequency"], units["noise"]) == ("Hz", "m/s2/Hz^0.5")


@event(table="tones", notice="tone")
class Tone(Event):
    """An event that a protocol declares."""

    level: float = column("m", "level of the tone")
    loud: bool = column("1", "whether it is loud", default=False)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A file with two events of a protocol."""
    path = tmp_path / "campaign.h5"
    record(begin(path, events=(Tone,)), block(0, 10), Tone(0.25, time=1.0), Tone(0.5, True, time=2.0))
    return path


def test_an_event_of_a_protocol_is_recorded_read_exported_and_recovered(path: Path) -> None:
    copy = path.with_name("recovered.h5")
    expected = [{"time": 1.0, "level": 0.25, "loud": False}, {"time": 2.0, "level": 0.5, "loud": True}]
    recover(path, copy)
    for each in (path, copy):
        with open_datafile(each) as kept:
            assert kept.rows_of(Tone) == expected
            assert kept.own_tables == ["tones"]
            assert "tones" not in kept.tables
            assert kept.counted["tones"] == 2
            assert [entry.kind for entry in kept.events] == ["Tone", "Tone"]
            exported = content_of(kept, each, raw=False).tables["tones"]
            assert [(column.name, column.unit) for column in exported] == [("time", "s"), ("level", "m"), ("loud", "")]


def test_rows_that_only_the_journal_has_are_recovered(tmp_path: Path) -> None:
    path, copy = tmp_path / "campaign.h5", tmp_path / "recovered.h5"
    record(begin(path, events=(Tone,)), block(0, 10), Tone(0.25, time=1.0))
    with journal_path(path).open("a", encoding="utf-8") as journal:
        columns = {"time": 2.0, "level": 0.5, "loud": True}
        line = {"time": 2.0, "kind": "Tone", "text": "loud", "columns": columns, "table": "tones"}
        journal.write(json.dumps(line) + "\n")
    recover(path, copy)
    with open_datafile(copy) as kept:
        assert kept.rows_of(Tone)[1] == columns


@pytest.mark.parametrize(
    "column", ["level", *(pytest.param(name, marks=pytest.mark.soak) for name in ("loud", "time"))]
)
def test_a_lost_column_of_a_table_of_a_protocol_is_restored_from_the_journal(path: Path, column: str) -> None:
    copy = path.with_name("recovered.h5")
    with h5py.File(path, "r+") as file:
        # an unknown kind of column cannot be read
        file[f"entry/tones/{column}"].attrs["kind"] = "unknown"
    assert recover(path, copy).lost == {}
    with open_datafile(copy) as kept:
        assert [row["level"] for row in kept.rows_of(Tone)] == [0.25, 0.5]
        assert [row["loud"] for row in kept.rows_of(Tone)] == [False, True]
        assert kept.integrity(None).failing == {}
        exported = content_of(kept, copy, raw=False).tables["tones"]
        assert [(each.name, each.unit) for each in exported] == [("time", "s"), ("level", "m"), ("loud", "")]


@event(table="unlisted", journalled=False)
class Frequent(Event):
    """An event with a table that is not stored in the journal."""

    value: float = column("1", "a value")


@event(table="invalid")
class Invalid(Event):
    """An event whose column has no type of the file."""

    value: Path = column("1", "a path")


def test_events_that_the_protocol_does_not_list_are_recorded_in_the_journal_with_one_warning(tmp_path: Path) -> None:
    path, copy = tmp_path / "campaign.h5", tmp_path / "recovered.h5"
    recorder, published = begin(path), list[Event]()
    stream = EventStream(VirtualClock(), [recorder, published.append], recorder.stores)
    stream.publish(block(0, 10))
    for each in (Tone(0.25), Tone(0.5), Frequent(0.75), Invalid(Path("p"))):
        stream.publish(each)
    recorder.close("completed")
    warnings = [each.text for each in published if isinstance(each, Warned)]
    assert len(warnings) == 3
    assert f"list it in `events` of its protocol, as '{__name__}:Tone'" in warnings[0]
    recover(path, copy)
    for each in (path, copy):
        with open_datafile(each) as kept:
            lines = [(entry.kind, entry.text) for entry in kept.events if entry.kind != "Warned"]
            assert lines[:2] == [("Tone", "level = 0.25, loud = False"), ("Tone", "level = 0.5, loud = False")]
            assert lines[2:] == [("Frequent", "value = 0.75"), ("Invalid", "value = p")]
            assert kept.own_tables == []


def test_a_table_with_the_name_of_the_points_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="points"):
        begin(tmp_path / "other.h5", events=(event(table="points")(type("Points", (Tone,), {"__doc__": "x"})),))


def test_the_mounted_spring_is_a_column_and_in_older_files_a_sentence(tmp_path: Path) -> None:
    path, spring = tmp_path / "campaign.h5", Specimen().coupled(0.64)
    works = ((Specimen().bare(), OperatorTask.REMOVE_BLOCK), (spring, OperatorTask.MOUNT_SPRING))
    record(begin(path), block(0, 10), *(SpecimenMounted(*each, time=1.0) for each in works))
    for old in (False, True):
        if old:
            with h5py.File(path, "r+") as file:
                del file["entry/operator_actions/beta"]
        with open_datafile(path) as kept:
            assert [row["beta"] for row in kept.entries_of(SpecimenMounted)] == [None, 0.64]


def test_the_line_of_an_event_is_that_of_journal_terminal_and_window(tmp_path: Path) -> None:
    path = tmp_path / "campaign.h5"
    shown = [
        event
        for event in (StepStarted("go", time=1.0), Warned("look", time=2.0), replace(TABLE, time=3.0))
        if event.notice
    ]
    record(begin(path), block(0, 10), *shown)
    out = StringIO()
    with PlainLines(out) as lines:
        for event in shown:
            lines(event)
    notices = [notice_of(event) for event in shown]
    with open_datafile(path) as kept:
        for entry, notice, line in zip(kept.events, notices, out.getvalue().splitlines(), strict=True):
            assert notice is not None
            assert entry.text == notice.text
            assert line.endswith(f"{notice.kind:<8} {entry.text}")
    assert [notice.grave for notice in notices if notice] == [False, True, False]


def test_the_terminal_shows_a_live_value_with_its_unit_and_prediction() -> None:
    scene = RunDisplay()
    scene.update(PERIOD)
    scene.update(replace(PERIOD, label="restitution", value=0.93, unit="1", predicted=float("nan"), time=3.5))
    drawn = "\n".join(rendered(scene))
    assert "period  (0.6412 ± 0.0031) s, predicted 0.6389 s, difference +0.4 %" in drawn
    assert "restitution  0.9300 ± 0.0031" in drawn
    scene.update(events.StateChanged(events.State.STOPPING, events.State.IDLE, "over", time=4.0))
    assert scene.live == {}


@pytest.mark.parametrize("own", [False, True])
def test_the_stream_stamps_what_has_no_time(own: bool) -> None:
    clock, published = VirtualClock(), list[Event]()
    clock.wait_until(10.0)
    stream = EventStream(clock, [published.append])
    clock.wait_until(12.5)
    stream.publish(StepStarted("go", time=1.0) if own else StepStarted("go"))
    assert [event.time for event in published] == [1.0 if own else 2.5]


@pytest.mark.parametrize("name", ["samples", "points", "metadata", "instrument", "checksums", "fitted", "events"])
def test_a_table_with_a_name_of_the_file_is_refused(tmp_path: Path, name: str) -> None:
    @event(table=name)
    class Own(Event):
        """Event of a plug-in."""

        value: float = column("1", "a value")

    with pytest.raises(InvalidInput, match="already used in the file"):
        begin(tmp_path / "campaign.h5", events=(Own,))
    assert not (tmp_path / "campaign.h5").exists()


def test_two_tables_of_one_name_are_refused(tmp_path: Path) -> None:
    @event(table="own")
    class First(Event):
        """Event of a plug-in."""

        value: float = column("1", "a value")

    @event(table="own")
    class Second(Event):
        """Event of a plug-in."""

        other: float = column("1", "another value")

    with pytest.raises(InvalidInput, match="already used in the file"):
        begin(tmp_path / "campaign.h5", events=(First, Second))
