import dataclasses
import re
import threading
import time
from io import StringIO

import numpy as np
import pytest
from rich.console import Console

from bench.app.cli.console import LiveConsole
from bench.app.cli.terminal import PlainLines, progress_on
from bench.app.formatting import clock, difference, number, one_line, plus_minus
from bench.app.run_display import RunDisplay
from bench.events import (
    Acquired,
    Event,
    LimitExceeded,
    OperatorAnswered,
    OperatorAsked,
    PointFinished,
    Progress,
    State,
    StateChanged,
    StepStarted,
    Warned,
)
from bench.findings import TableIdentified
from bench.live_values import Estimate, RunningGain
from drivers.rig import Block
from protocols.common.replicate import PassFinished
from protocols.harmonic.protocol import HarmonicPoint, PointStatus
from protocols.identify.protocol import IdentifiedBand
from tests.bench.twin.twin_bench import estimate
from tests.command_line import rendered
from tests.patience import eventually

NAN = float("nan")
STEADY = HarmonicPoint(
    omega_rad_s=12.5,
    beta=0.25,
    status=PointStatus.STEADY,
    layer="rocking",
    alpha_2=0.91234,
    alpha_2_uncertainty=0.0081,
    alpha_2_predicted=0.9098,
    predicted_stable=True,
    agrees=True,
    starts_tried=1,
    cycles_measured=24,
)
OVERTURNED = HarmonicPoint(
    omega_rad_s=15.0,
    beta=0.25,
    status=PointStatus.OVERTURNED,
    layer="rocking",
    alpha_2_predicted=0.5,
    predicted_stable=False,
    starts_tried=6,
    reason="the block fell\nin each start",
)
CAMPAIGN: list[Event] = [
    OperatorAsked("Take the block off.", time=0.0),
    OperatorAnswered("Take the block off.", "the simulated bench", time=0.0),
    StepStarted("bare frame at 12.5 rad/s", time=2.0),
    Estimate(12.5, None, 80, 0.01, NAN, NAN, NAN, time=60.0),
    Warned("laser_1 lost\x1b[2J 12 samples", time=300.0),
    PointFinished(STEADY, time=700.0),
    PointFinished(OVERTURNED, time=1200.0),
    StateChanged(State.ARMED, State.RUNNING, "at rest, zero taken", time=1400.0),
    StepStarted("beta = 0.64 at 17.5 rad/s, start 1 of 6", time=1430.0),
    Estimate(17.5, 0.64, 140, 0.01, 0.7312, 0.033, 0.7251, time=1500.0),
    Progress(0.45, 2200.0, "settling at 17.5 rad/s", time=1500.0),
]
BLOCK = Acquired(1, Block(0, np.zeros((200, 4), dtype=np.int16)), np.zeros(200), time=1.0)


def scene_after(events: list[Event]) -> RunDisplay:
    scene = RunDisplay()
    for event in events:
        scene.update(event)
    return scene


def line_with(lines: list[str], *texts: str) -> str:
    found = [line for line in lines if all(text in line for text in texts)]
    assert len(found) == 1, (texts, lines)
    return found[0]


def test_the_picture_shows_points_the_present_dwell_progress_and_the_last_events():
    lines = rendered(scene_after(CAMPAIGN))
    assert re.match(r" RUNNING +beta = 0.64 at 17.5 rad/s, start 1 of 6", lines[0])
    assert line_with(lines, "12.5", "0.25", "0.9123 ± 0.0081", "0.9098", "+0.3 %", "yes", "steady", "24 cycles")
    assert line_with(lines, "15", "0.5000 unstable", "overturned", "6 starts")
    assert line_with(lines, "17.5", "0.64", "0.731 ± 0.033", "0.7251", "+0.8 %", "measuring", "140 cycles")
    assert line_with(lines, "45 %", "bench time 25:00, about 36:40 left", "settling at 17.5 rad/s")
    assert line_with(lines, "5:00", "warning", "lost[2J 12 samples")
    assert line_with(lines, "Ctrl-C")


def test_a_narrow_terminal_loses_no_number():
    lines = rendered(scene_after(CAMPAIGN), width=80)
    assert max(len(line) for line in lines) <= 80
    assert line_with(lines, "12.5", "0.25", "0.9123 ± 0.0081", "0.9098", "+0.3 %", "yes", "steady")
    assert line_with(lines, "0.5000 unstable", "overturned")


def test_a_long_remark_is_written_out_for_the_first_point_that_has_it() -> None:
    laser, others = "the linearity error of laser_1 " * 3, ("captured after cycle 40", "the motion differs")
    points = [STEADY.model_copy(update={"reason": f"{other}; {laser}"}) for other in (*others, others[0])]
    out = StringIO()
    with PlainLines(out) as lines:
        for point in points:
            lines(PointFinished(point, time=1.0))
    ends = [line[line.index("(") :] for line in out.getvalue().splitlines()]
    assert ends[0] == f"({others[0]}; {laser.strip()})"
    assert ends[1:] == [f"({other}; 1 remark as before)" for other in (others[1], others[0])]


def test_many_points_leave_the_picture_within_the_terminal():
    events: list[Event] = [PointFinished(STEADY, time=0.0) for _ in range(60)]
    lines = rendered(scene_after([*CAMPAIGN, *events]), height=30)
    assert len(lines) <= 30
    assert line_with(lines, "earlier points not shown")
    assert line_with(lines, "45 %")


def test_an_abort_is_told_in_words():
    over = LimitExceeded("table velocity", 0.71234, 0.6, "m/s", time=10.0)
    abort = StateChanged(State.RUNNING, State.ABORTING, "table velocity 0.7123 m/s exceeds 0.6 m/s", time=10.0)
    lines = rendered(scene_after([*CAMPAIGN, over, abort]))
    assert re.match(r" ABORTING +table velocity 0.7123 m/s exceeds", lines[0])
    assert line_with(lines, "LIMIT", "table velocity reached 0.71234 m/s; limit 0.6 m/s")


def test_plain_lines_are_one_per_event_and_free_of_control_characters():
    stream = StringIO()
    with PlainLines(stream) as lines:
        for event in [*CAMPAIGN, BLOCK]:
            lines(event)
    text = stream.getvalue()
    kinds = [line.split()[3] for line in text.splitlines()]
    assert kinds == ["asked", "done", "step", "warning", "point", "point", "step"]
    assert all(character.isprintable() for character in text.replace("\n", ""))
    assert "(the block fell in each start)" in text


def test_a_pipe_gets_plain_lines_and_a_terminal_the_live_picture(monkeypatch: pytest.MonkeyPatch):
    class Terminal(StringIO):
        def isatty(self) -> bool:
            return True

    for name in ("NO_COLOR", "FORCE_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TERM", "xterm")
    assert isinstance(progress_on(StringIO(), person_answers=False), PlainLines)
    assert isinstance(progress_on(Terminal(), person_answers=False), LiveConsole)
    monkeypatch.setenv("TERM", "dumb")
    assert isinstance(progress_on(Terminal(), person_answers=False), PlainLines)


def terminal() -> Console:
    return Console(file=StringIO(), force_terminal=True, width=110, height=40, color_system=None)


def written(console: Console) -> str:
    assert isinstance(console.file, StringIO)
    return console.file.getvalue()


def wait_for(console: Console, text: str) -> None:
    eventually(lambda: text in written(console), f"{text} was never drawn")


HIDE, SHOW = "\x1b[?25l", "\x1b[?25h"


def test_the_terminal_is_restored_after_an_exception_and_warnings_stay():
    console = terminal()

    def break_down() -> None:
        with LiveConsole(console) as live:
            live(Warned("the laser blinked", time=3.0))
            assert HIDE in written(console)
            raise RuntimeError("the plan broke")

    with pytest.raises(RuntimeError, match="plan broke"):
        break_down()
    assert written(console).count(SHOW) == written(console).count(HIDE) == 1
    assert written(console).rindex(SHOW) > written(console).rindex(HIDE)
    assert "the laser blinked" in written(console)
    assert not [thread for thread in threading.enumerate() if thread.name == "console"]


def test_the_picture_makes_room_for_a_question_only_if_a_person_answers():
    for person, hidden in ((True, 1), (False, 0)):
        console = terminal()
        with LiveConsole(console, person_answers=person) as live:
            live(CAMPAIGN[0])
            assert written(console).count(SHOW) == hidden
            live(CAMPAIGN[1])
            live(CAMPAIGN[2])
            wait_for(console, "bare frame at 12.5 rad/s")
        assert written(console).count(SHOW) == written(console).count(HIDE) == hidden + 1


def test_nothing_is_drawn_without_a_change_and_at_most_eight_times_a_second():
    console = terminal()
    with LiveConsole(console) as live:
        live(CAMPAIGN[2])
        wait_for(console, "bare frame")
        before = len(written(console))
        for _ in range(100):
            live(BLOCK)
        time.sleep(0.2)
        assert len(written(console)) == before
        begin, drawn = time.monotonic(), written(console).count("bench time")
        while (elapsed := time.monotonic() - begin) < 0.6 or written(console).count("bench time") == drawn:
            live(Progress(elapsed, 1.0, "settling", time=elapsed))
            time.sleep(0.001)
        assert 1 <= written(console).count("bench time") - drawn <= 8 * elapsed + 2


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        (clock(0.0), "0:00"),
        (clock(59.6), "1:00"),
        (clock(3750.0), "1:02:30"),
        (clock(NAN), "-"),
        (number(1234.4), "1234"),
        (number(0.5), "0.5000"),
        (number(None), "-"),
        (plus_minus(0.82627, 0.00413), "0.8263 ± 0.0041"),
        (plus_minus(2.37277, 0.113), "2.37 ± 0.11"),
        (plus_minus(0.5, None), "0.5000"),
        (plus_minus(NAN, 0.1), "-"),
        (difference(1.02, 1.0), "+2.0 %"),
        (difference(1.0 - 1e-6, 1.0), "+0.0 %"),
        (difference(1.0, None), "-"),
        (one_line("a\n b\x07\tc"), "a b c"),
    ],
)
def test_numbers_and_texts_as_the_operator_reads_them(said: str, expected: str):
    assert said == expected


def test_passes_and_running_gains_are_shown_and_bands_are_no_points() -> None:
    running = RunningGain("1999 Chi-Chi", 0.25, 12.34, 0.002, 0.8412, 0.8533, time=31.0)
    passed = PassFinished("1999 Chi-Chi", 2, 0.005, 0.003, 0.01, 0.01, True, "pass 2 (gain 1): error 0.50%", time=20.0)
    found = TableIdentified("bare frame, 0.5 to 200 Hz", *[np.zeros(3)] * 7, time=9.0)
    band = IdentifiedBand(
        frequency_hz=1.0,
        gain_m_s2_v=0.3,
        phase_rad=1.0,
        uncertainty=0.01,
        distortion=0.01,
        noise_m_s2_hz=2e-4,
        coherence=0.999,
        lines=3,
    )
    lines = rendered(scene_after([found, PointFinished(band, time=9.0), passed, running]))
    line_with(lines, "table", "bare frame, 0.5 to 200 Hz")
    line_with(lines, "pass", "1999 Chi-Chi: pass 2 (gain 1): error 0.50%")
    line_with(lines, "1999 Chi-Chi", "0.25", "0.8412", "0.8533", "-1.4 %", "12.3 s")
    out = StringIO()
    with PlainLines(out) as plain:
        for event in (found, PointFinished(band, time=9.0), passed, running):
            plain(event)
    assert [line.split()[3] for line in out.getvalue().splitlines()] == ["table", "pass"]


def test_the_twin_has_a_line_while_the_bench_is_driven() -> None:
    said = estimate(residual=0.0031, excess=NAN, drift_peak=0.01819, drift_peak_measured=0.01822, alpha_2=NAN)
    scene = scene_after([*CAMPAIGN, said])
    line = line_with(rendered(scene), "twin")
    assert line == "twin  drift peak 18.22 mm, model 18.19 mm; residual 0.3 %, excess over the band -"
    known = {"alpha_2": 0.3074, "alpha_2_low": 0.222, "alpha_2_high": 0.442, "alpha_2_measured": 0.3071}
    scene.update(dataclasses.replace(said, standing=0.975, **known))
    line_with(rendered(scene, width=160), "alpha_2 0.3071, model 0.3074 (0.2220 to 0.4420); blocks standing 98%")
    scene.update(StateChanged(State.STOPPING, State.IDLE, "the output is at zero", time=1600.0))
    assert not [line for line in rendered(scene) if line.startswith("twin")]
