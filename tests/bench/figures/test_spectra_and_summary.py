"""What a person or a program takes away: figure, summary, table."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.container import ErrorbarContainer
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from bench.figures.spectra_figure import Prediction, gain_spectra
from bench.figures.style import BLUE, GREEN, write_figure
from bench.figures.summary import Summary, write_summary
from protocols.harmonic.campaign import WIDTH, points_table
from protocols.harmonic.protocol import HarmonicPoint, PointStatus
from sim.errors import InvalidInput, RockbenchError

OMEGA = np.linspace(12.0, 21.0, 91)


def prediction() -> dict[str, NDArray[Any]]:
    """Made-up branches with the traits of the real ones: a minimum, a peak of 9, an unstable stretch, two of them."""
    parts = list[tuple[NDArray[np.float64], float, NDArray[np.float64], NDArray[np.bool_], str]]()
    for beta, peak in ((0.25, 18.0), (0.64, 20.0), (0.97, 22.0)):
        gain = 0.3 + 8.7 / (1.0 + (3.0 * (OMEGA - peak)) ** 2)
        stable = (OMEGA > 14.0) | (beta < 0.5)
        parts.append((OMEGA, beta, gain, stable, "rocking"))
        high = OMEGA[peak <= OMEGA]
        parts.append((high, beta, 60.0 / (1.0 + (high - peak)), np.full(high.size, True), "resting"))
    return {
        "omega": np.concatenate([part[0] for part in parts]),
        "beta": np.concatenate([np.full(part[0].size, part[1]) for part in parts]),
        "alpha_2": np.concatenate([part[2] for part in parts]),
        "stable": np.concatenate([part[3] for part in parts]),
        "layer": np.concatenate([np.full(part[0].size, part[4]) for part in parts]),
    }


def point(omega: float, beta: float, status: str = "steady", alpha: float | None = 0.5, **more: Any) -> HarmonicPoint:
    return HarmonicPoint(
        omega_rad_s=omega,
        beta=beta,
        status=PointStatus(status),
        layer="resting" if status == "resting" else "rocking",
        alpha_2=alpha,
        alpha_2_uncertainty=None if alpha is None else 0.02,
        **more,
    )


POINTS = [
    point(12.5, 0.25, alpha_2_predicted=0.505, predicted_stable=True, agrees=True, starts_tried=1, settle_time_s=41.26),
    point(20.0, 0.25, "resting", 2.1),
    point(12.5, 0.64, "overturned", None, starts_tried=6, reason="the block overturned in each of 6 starts"),
    point(15.0, 0.97, "modulated", 0.75, alpha_2_predicted=0.5, predicted_stable=False, agrees=False),
]


@pytest.fixture(scope="module")
def figure() -> Figure:
    return gain_spectra(POINTS, prediction(), title="Harmonic campaign")


def lines(panel: Axes, label: str) -> list[Line2D]:
    return [line for line in panel.lines if line.get_label() == label]


def bars(panel: Axes) -> dict[str, ErrorbarContainer]:
    return {str(each.get_label()): each for each in panel.containers if isinstance(each, ErrorbarContainer)}


def data(line: Line2D) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    x, y = line.get_data()
    return np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)


def test_one_panel_per_stiffness(figure: Figure) -> None:
    assert [panel.get_title() for panel in figure.axes] == [rf"$\beta$ = {beta}" for beta in (0.25, 0.64, 0.97)]
    assert len({panel.get_ylim() for panel in figure.axes}) == 1
    assert all(panel.get_yscale() == "log" for panel in figure.axes)


def test_the_predicted_branch_is_solid_and_its_unstable_part_is_dashed_without_a_gap(figure: Figure) -> None:
    whole = lines(figure.axes[0], "predicted, block rocking")[0]
    assert (whole.get_linestyle(), to_hex(whole.get_color())) == ("-", BLUE.lower())
    x, y = data(whole)
    np.testing.assert_allclose(y, 0.3 + 8.7 / (1.0 + (3.0 * (x - 18.0)) ** 2))
    assert not lines(figure.axes[0], "predicted, block rocking, unstable")
    stable, unstable = (lines(figure.axes[1], f"predicted, block rocking{kind}")[0] for kind in ("", ", unstable"))
    assert unstable.get_linewidth() < stable.get_linewidth()
    assert unstable.get_linestyle() == "--"
    (x, solid), (_, dashed) = data(stable), data(unstable)
    np.testing.assert_array_equal(np.isfinite(solid), x > 14.0)
    # both hold the first stable frequency, so they meet
    np.testing.assert_array_equal(np.isfinite(dashed), x < 14.15)


def test_the_resting_branch_is_another_line_where_it_exists(figure: Figure) -> None:
    line = lines(figure.axes[1], "predicted, block resting")[0]
    assert to_hex(line.get_color()) == GREEN.lower()
    assert data(line)[0].min() == pytest.approx(20.0)
    assert not lines(figure.axes[2], "predicted, block resting")


def test_measured_points_have_markers_by_status_and_their_uncertainty(figure: Figure) -> None:
    first, _, last = (bars(panel) for panel in figure.axes)
    assert set(first) == {"measured, steady", "measured, resting"}
    markers = {name: each.lines[0].get_marker() for name, each in (first | last).items()}
    assert len(set(markers.values())) == 3
    steady = first["measured, steady"]
    (segment,) = steady.lines[2][0].get_segments()
    np.testing.assert_allclose(np.asarray(segment), [[12.5, 0.48], [12.5, 0.52]])


def test_an_overturned_point_is_a_cross_at_the_edge_with_the_word(figure: Figure) -> None:
    panel = figure.axes[1]
    cross = lines(panel, "no gain measured")[0]
    assert cross.get_marker() == "X"
    np.testing.assert_allclose(np.column_stack(data(cross)), [[12.5, 0.95]])
    assert [text.get_text() for text in panel.texts] == ["overturned"]


def test_disagreement_is_ringed_and_unity_is_drawn(figure: Figure) -> None:
    ring = lines(figure.axes[2], "disagrees with the prediction")[0]
    np.testing.assert_allclose(np.column_stack(data(ring)), [[15.0, 0.75]])
    assert not lines(figure.axes[0], "disagrees with the prediction")
    for panel in figure.axes:
        unity = next(line for line in panel.lines if "no effect" in str(line.get_label()))
        assert unity.get_linestyle() == "-."
        np.testing.assert_allclose(data(unity)[1], 1.0)


def test_the_range_shows_the_rocking_peak_and_lets_a_resonance_of_60_leave(figure: Figure) -> None:
    low, high = figure.axes[0].get_ylim()
    assert low < 0.3
    assert 9.0 < high < 30.0


def test_no_measured_gain_is_out_of_sight() -> None:
    for gain in (0.002, 300.0):
        low, high = gain_spectra([point(15.0, 0.25, alpha=gain)], prediction()).axes[0].get_ylim()
        assert low < gain < high


def test_the_legend_names_each_thing_once_and_predictions_first(figure: Figure) -> None:
    (legend,) = figure.legends
    labels = [text.get_text() for text in legend.get_texts()]
    assert labels == [
        "predicted, block rocking",
        "predicted, block rocking, unstable",
        "predicted, block resting",
        r"$\alpha_2$ = 1: the block has no effect",
        "measured, steady",
        "measured, modulated",
        "measured, resting",
        "no gain measured",
        "disagrees with the prediction",
    ]


def test_the_file_has_200_dots_per_inch_and_nothing_outside(figure: Figure, tmp_path: Path) -> None:
    path = tmp_path / "spectra.png"
    write_figure(path, figure)
    pixels = imread(path)
    width, height = figure.get_size_inches() * 200
    assert pixels.shape[:2] == (round(height), round(width))
    # ink at the border would be a label that is cut
    frame = np.concatenate([pixels[[0, -1], :, :3].reshape(-1, 3), pixels[:, [0, -1], :3].reshape(-1, 3)])
    assert frame.min() == 1.0
    with pytest.raises(InvalidInput, match="never overwritten"):
        write_figure(path, figure)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("betas", [(), (0.5,), (0.1, 0.2, 0.3, 0.4, 0.5)])
def test_any_number_of_stiffnesses_draws(betas: tuple[float, ...], tmp_path: Path) -> None:
    nothing: Prediction = {name: np.array([]) for name in ("omega", "beta", "alpha_2", "stable", "layer")}
    drawn = gain_spectra([point(15.0, beta) for beta in betas], nothing)
    assert len(drawn.axes) == max(1, len(betas))
    write_figure(tmp_path / "spectra.png", drawn)


def summary(**changes: Any) -> Summary:
    settings: dict[str, Any] = {
        "protocol": "harmonic",
        "status": "completed",
        "points": POINTS,
        "file": Path("runs") / "campaign.h5",
        "figure": None,
        "reason": "4 points",
        "software": "rocking-bench 0.1.0",
        "seed": 7,
        "elapsed": 12.5,
        "bench_time": 2500.0,
    }
    return Summary(**(settings | changes))


def test_summary_is_plain_json_that_gives_the_points_back(tmp_path: Path) -> None:
    path = tmp_path / "summary.json"
    write_summary(path, summary())
    content = json.loads(path.read_text(encoding="utf-8"), parse_constant=pytest.fail)
    assert [HarmonicPoint.model_validate(each) for each in content.pop("points")] == POINTS
    assert content == {
        "protocol": "harmonic",
        "status": "completed",
        "file": "runs/campaign.h5",
        "figure": None,
        "reason": "4 points",
        "software": "rocking-bench 0.1.0",
        "seed": 7,
        "elapsed_s": 12.5,
        "bench_time_s": 2500.0,
    }


def test_summary_turns_nan_and_enumerations_into_json(tmp_path: Path) -> None:
    raw = {"status": PointStatus.STEADY, "alpha_2": float("nan"), "drift": np.float64(0.25), "list": [float("inf"), 1]}
    write_summary(tmp_path / "s.json", summary(points=[raw], elapsed=float("nan")))
    content = json.loads((tmp_path / "s.json").read_text(encoding="utf-8"))
    assert content["points"] == [{"status": "steady", "alpha_2": None, "drift": 0.25, "list": [None, 1]}]
    assert content["elapsed_s"] is None


def test_summary_is_never_overwritten_nor_left_half_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "summary.json"
    path.write_text("precious")
    with pytest.raises(InvalidInput, match="never overwritten"):
        write_summary(path, summary())
    assert path.read_text() == "precious"
    with pytest.raises(InvalidInput, match="folder"):
        write_summary(tmp_path / "missing" / "summary.json", summary())

    def fail(*_: Any, **__: Any) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as broken:
        broken.setattr(Path, "write_text", fail)
        with pytest.raises(RockbenchError, match="No space left"):
            write_summary(tmp_path / "other.json", summary())
    assert list(tmp_path.iterdir()) == [path]


def test_table_shows_every_point_once_with_units_and_dashes() -> None:
    text = points_table(POINTS)
    head, units, rule, *rest = text.splitlines()
    assert head.split()[:5] == ["beta", "omega", "status", "branch", "alpha_2"]
    assert "[rad/s]" in units
    assert set(rule) == {"-"}
    assert rest[0].split() == [
        *("0.250", "12.500", "steady", "rocking", "0.5000", "0.0200", "0.5050", "-0.99"),
        *("stable", "1", "-", "41.3", "yes"),
    ]
    assert rest[2].split() == ["0.640", "12.500", "overturned", "rocking", *"-----", "6", "-", "-", "-"]
    assert rest[3].endswith("NO <")
    assert text.count("NO <") == 1


def test_table_stays_narrow_and_says_what_needs_a_look() -> None:
    crowd = [*POINTS, point(20.0, 0.97, "modulated", 1234.5678, agrees=False, reason="many words " * 40)]
    text = points_table(crowd)
    assert max(map(len, text.splitlines())) <= WIDTH
    assert "3 of 5 points compared with the prediction, 2 disagree." in text
    assert "omega 12.5 rad/s, beta 0.64: the block overturned in each of 6 starts" in text


def test_the_largest_contribution_is_named_with_its_remedy() -> None:
    def text(*names: str) -> str:
        points = [
            point(12.5 + k, 0.97, "steady", 0.5, agrees=True).model_copy(update={"dominating": name})
            for k, name in enumerate(names)
        ]
        return " ".join(points_table(points).split())

    two = text("scatter of the cycles", "scatter of the cycles", "amplitude of the table")
    assert "scatter of the cycles (2), amplitude of the table (1). To reduce the first: measure more cycles." in two
    assert "amplitude of the table (1). To reduce it: calibrate the accelerometer" in text("amplitude of the table")
    assert "To reduce" not in text("a name of another program")


def test_a_remark_on_every_point_is_listed_once() -> None:
    common = "the linearity error of laser_2 is not smooth"
    points = [
        point(omega, 0.97, "steady", 0.5, agrees=True, reason=reason)
        for omega, reason in ((12.5, common), (15.0, f"free: not steady; {common}; held"))
    ]
    lines = points_table(points).splitlines()[-2:]
    assert lines == [f"every point: {common}", "omega 15 rad/s, beta 0.97: free: not steady; held"]


def test_table_takes_points_as_the_record_gives_them() -> None:
    assert points_table([each.model_dump(mode="json") for each in POINTS]) == points_table(POINTS)
    assert "No point was measured." in points_table([])
