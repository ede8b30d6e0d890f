"""The figures of predictions, inspected: what is drawn where, in which style, with which words."""

from math import nan
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from bench.app.cli.main import main
from bench.figures.history_figure import Motion, history_figure
from bench.figures.map_figure import BranchGrid, least_over_omega, levels_for, map_figure
from bench.figures.modes_figure import modes_figure
from bench.figures.stability_figure import stability_figure
from bench.figures.style import GREEN, PURPLE, VERMILLION, new_figure, write_figure
from sim.errors import InvalidInput
from sim.specimen import Specimen


def modes(betas: list[float]) -> dict[str, NDArray[Any]]:
    """Made-up modes with the traits of the real ones: two of the bare frame, three of each coupled system."""
    rows = [("bare", nan, 1, 6.0, 4.0, nan), ("bare", nan, 2, 16.0, -0.25, nan)]
    for beta in betas:
        rows += [
            ("coupled", beta, 1, -5.0 + beta, 0.7, -20.0),
            ("coupled", beta, 2, 6.0 + beta, 5.0, 1.0),
            ("coupled", beta, 3, 16.0 + 5.0 * beta, -0.2, 0.2),
        ]
    system, beta, mode, omega, u2, theta = (np.array(column) for column in zip(*rows, strict=True))
    divergent = omega < 0.0
    return {
        "system": system,
        "beta": beta,
        "mode": mode,
        "divergent": divergent,
        "omega_rad_s": np.where(divergent, nan, omega),
        "frequency_hz": np.where(divergent, nan, omega / (2.0 * np.pi)),
        "growth_rate_per_s": np.where(divergent, -omega, nan),
        "shape_u1": np.ones(len(rows)),
        "shape_u2": u2,
        "shape_theta_rad_per_m": theta,
    }


def labelled(panel: Axes, label: str) -> Line2D:
    (line,) = [line for line in panel.lines if line.get_label() == label]
    return line


def y_of(line: Line2D) -> NDArray[np.float64]:
    return np.asarray(line.get_ydata(), dtype=np.float64)


def legend_of(figure: Figure) -> list[str]:
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


def overlapping_texts(figure: Figure) -> list[tuple[str, str]]:
    """Titles, labels and notes that lie on one another once the figure is drawn."""
    figure.draw_without_rendering()
    texts = [text for panel in figure.axes for text in (panel.title, panel.xaxis.label, panel.yaxis.label)]
    texts += [text for panel in figure.axes for text in panel.texts]
    shown = [(text.get_text(), text.get_window_extent()) for text in texts if text.get_text()]
    return [
        (word, other)
        for k, (word, box) in enumerate(shown)
        for other, another in shown[k + 1 :]
        if box.overlaps(another)
    ]


def test_shapes_say_frequencies_and_that_a_mode_is_divergent() -> None:
    figure = modes_figure(modes([0.25, 0.64]), Specimen())
    assert [panel.get_title() for panel in figure.axes if panel.get_title()] == [
        "bare frame",
        r"$\beta$ = 0.25",
        r"$\beta$ = 0.64",
    ]
    captions = [panel.get_xlabel() for panel in figure.axes]
    assert captions.count("divergent\ngrows at 4.750 s$^{-1}$") == 1
    assert sum("divergent" in caption for caption in captions) == 2
    assert "$\\omega$ = 16.000 rad/s\n$f$ = 2.546 Hz" in captions
    assert not overlapping_texts(figure)


def test_the_modes_of_the_frame_stand_beside_the_last_two_of_the_coupled_system() -> None:
    figure = modes_figure(modes([0.25]), Specimen())
    figure.draw_without_rendering()
    heights = {panel.get_xlabel().split("\n")[0]: panel.get_position().y0 for panel in figure.axes}
    bare, coupled = heights["$\\omega$ = 6.000 rad/s"], heights["$\\omega$ = 6.250 rad/s"]
    assert bare == pytest.approx(coupled)
    assert heights["divergent"] > bare > heights["$\\omega$ = 17.250 rad/s"]


def test_a_shape_displaces_storeys_and_block_in_proportion() -> None:
    figure = modes_figure(modes([0.25]), Specimen())
    (panel,) = [panel for panel in figure.axes if "17.250" in panel.get_xlabel()]
    # floors are horizontal lines between two points: those at rest, then the displaced ones
    floors = [line for line in panel.lines if len(line.get_xdata()) == 2 and y_of(line)[0] > 0.0]
    ends = [float(np.asarray(line.get_xdata())[1]) for line in floors]
    assert ends[:2] == [0.0, 0.0]
    assert ends[3] / ends[2] == pytest.approx(-0.2)
    specimen = Specimen()
    rest, displaced = (np.asarray(patch.get_path().vertices) for patch in panel.patches)
    # positive rotation keeps the left corner and takes the top towards the frame, which is on the left
    assert displaced[0].tolist() == rest[0].tolist() == [specimen.d, 0.0]
    assert displaced[3, 0] < rest[3, 0]
    turned = np.arctan2(displaced[1, 1] - displaced[0, 1], displaced[1, 0] - displaced[0, 0])
    assert turned / ends[2] == pytest.approx(0.2)


def test_many_stiffnesses_become_curves_with_growth_apart_from_frequency() -> None:
    betas = np.linspace(0.1, 1.2, 12)
    figure = modes_figure(modes(betas.tolist()), Specimen())
    upper, lower = figure.axes
    np.testing.assert_allclose(y_of(labelled(upper, "coupled, mode 3")), 16.0 + 5.0 * betas)
    np.testing.assert_allclose(y_of(labelled(lower, "coupled, mode 1, divergent")), 5.0 - betas)
    assert "[rad/s]" in upper.get_ylabel()
    assert "[s$^{-1}$]" in lower.get_ylabel()
    assert not overlapping_texts(figure)


TIME = np.linspace(0.0, 4.0, 801)


def motion(name: str = "from rest", end: float = 9.0) -> Motion:
    lost = end < TIME
    swing = np.where(lost, nan, np.sin(9.0 * TIME))
    fall = np.where(lost, nan, 0.02 * np.sin(9.0 * TIME) - 1.5 * np.clip(TIME - 2.0, 0.0, None) ** 3)
    return Motion(
        omega=16.0,
        beta=0.4,
        name=name,
        status="completed" if end > TIME[-1] else "overturned about B",
        values={
            "time_s": TIME,
            "drift_m": 0.01 * swing,
            "bare_drift_m": 0.05 * np.sin(9.0 * TIME),
            "u1_m": 0.003 * swing,
            "theta_rad": 0.03 * swing if end > TIME[-1] else fall,
        },
    )


def test_a_history_shows_drifts_on_the_left_and_u1_with_theta_on_the_right() -> None:
    figure = history_figure([motion("rocking")])
    left, right, angle = figure.axes
    np.testing.assert_allclose(y_of(labelled(left, "drift of the coupled frame")), 10.0 * np.sin(9.0 * TIME))
    np.testing.assert_allclose(y_of(labelled(left, "drift of the bare frame")), 50.0 * np.sin(9.0 * TIME))
    assert labelled(left, "drift of the bare frame").get_linestyle() == "--"
    np.testing.assert_allclose(y_of(labelled(right, r"$u_1$, left axis")), 3.0 * np.sin(9.0 * TIME))
    theta = labelled(angle, r"$\vartheta$, right axis")
    np.testing.assert_allclose(y_of(theta), 30.0 * np.sin(9.0 * TIME))
    assert to_hex(theta.get_color()) == VERMILLION.lower()
    # both zeros at the same height
    for panel in (left, right, angle):
        low, high = panel.get_ylim()
        assert low == -high
    assert left.get_title(loc="left") == r"(a)  $\Omega$ = 16 rad/s,  $\beta$ = 0.4"
    assert right.get_title(loc="right") == "rocking: completed"
    assert [panel.get_ylabel().split()[-1] for panel in (left, right, angle)] == ["[mm]", "[mm]", "[mrad]"]
    assert "block overturned" not in legend_of(figure)
    assert not overlapping_texts(figure)


def test_a_fall_is_marked_and_does_not_flatten_what_came_before() -> None:
    figure = history_figure([motion(), motion(end=2.8)])
    assert legend_of(figure).count("block overturned") == 1
    left, right, angle = figure.axes[3:]
    for panel in (left, right):
        end = float(np.asarray(labelled(panel, "block overturned").get_xdata())[0])
        assert end == pytest.approx(2.8, abs=0.01)
    assert 20.0 < angle.get_ylim()[1] < 100.0
    assert left.get_title(loc="left").startswith("(b)")


def test_a_block_that_rests_gets_an_axis_all_the_same() -> None:
    still = motion("resting")
    still.values["theta_rad"][:] = 0.0  # type: ignore[index]
    figure = history_figure([still])
    assert figure.axes[2].get_ylim() == (-1.0, 1.0)


OMEGAS, BETAS = np.linspace(12.0, 21.0, 46), np.linspace(0.1, 1.2, 23)


def branches() -> tuple[BranchGrid, BranchGrid, NDArray[np.float64]]:
    """Made-up branches: a valley along omega = 16 + beta, unstable in a corner, resting where omega > 17 + 5 beta."""
    omega, beta = np.meshgrid(OMEGAS, BETAS)
    gain = np.exp(0.3 * (omega - 16.0 - beta) ** 2 - 2.0)
    multiplier = np.where((omega < 14.0) & (beta > 0.6), 1.1, 0.97)
    margin = 0.1 * (omega - 17.0 - 5.0 * beta)
    rests = margin > 0.0
    rocking = BranchGrid({"alpha_1": gain, "alpha_2": 2.0 * gain}, multiplier)
    resting = BranchGrid(dict.fromkeys(("alpha_1", "alpha_2"), np.where(rests, 3.0, nan)), np.where(rests, 0.98, nan))
    return rocking, resting, margin


@pytest.fixture(scope="module")
def gain_maps() -> Figure:
    return map_figure(OMEGAS, BETAS, *branches())


def test_surfaces_stand_above_the_maps_of_both_branches(gain_maps: Figure) -> None:
    titles = [panel.get_title(loc="left") for panel in gain_maps.axes]
    for gain in (r"$\alpha_1$", r"$\alpha_2$"):
        assert [title for title in titles if gain in title] == [
            f"(a)  {gain}, block rocking",
            f"(b)  {gain}, block rocking",
            f"(c)  {gain}, block resting",
        ]
    assert [panel.name for panel in gain_maps.axes] == ["3d", "rectilinear", "rectilinear"] * 2
    for panel in gain_maps.axes:
        assert panel.get_xlabel() == r"$\Omega$  [rad/s]"
    assert set(legend_of(gain_maps)) == {
        "gain region: below 1",
        "no gain: above 1",
        "gain of 1",
        r"minimum over $\Omega$",
        "rocking motion unstable",
        "block may rest to the right of this line",
    }


def test_the_line_of_the_least_gain_follows_the_valley(gain_maps: Figure) -> None:
    panel = gain_maps.axes[4]
    (line,) = panel.lines
    assert (line.get_linestyle(), to_hex(line.get_color())) == ("-.", PURPLE.lower())
    np.testing.assert_allclose(np.asarray(line.get_xdata()), 16.0 + BETAS, rtol=1e-9)
    np.testing.assert_allclose(y_of(line), BETAS)


def segments(panel: Axes, colour: str) -> NDArray[np.float64]:
    """Points of the contours of one colour, shape (n, 2)."""
    found = [
        path.vertices
        for drawn in panel.collections
        if np.size(drawn.get_edgecolor()) and not np.size(drawn.get_facecolor())
        for edge in [to_hex(np.atleast_2d(drawn.get_edgecolor())[0])]
        if edge == colour.lower()
        for path in drawn.get_paths()
    ]
    return np.concatenate([np.asarray(vertices) for vertices in found])


def test_the_resting_boundary_and_the_unstable_region_lie_where_they_should(gain_maps: Figure) -> None:
    panel = gain_maps.axes[1]
    boundary = segments(panel, GREEN)
    np.testing.assert_allclose(boundary[:, 0], 17.0 + 5.0 * boundary[:, 1], atol=1e-9)
    (hatched,) = [drawn for drawn in panel.collections if getattr(drawn, "hatches", [None]) == ["////"]]
    corners = np.concatenate([np.asarray(path.vertices) for path in hatched.get_paths()])
    assert corners[:, 0].max() < 14.2
    assert corners[:, 1].min() > 0.55


def test_without_a_resting_branch_there_is_no_row_for_it() -> None:
    rocking, resting, margin = branches()
    nowhere = BranchGrid({name: gain * nan for name, gain in resting.gains.items()}, resting.multiplier * nan)
    figure = map_figure(OMEGAS, BETAS, rocking, nowhere, -np.abs(margin) - 1.0)
    assert len(figure.axes) == 4
    assert "block may rest to the right of this line" not in legend_of(figure)


def test_a_least_gain_on_the_edge_or_beside_a_gap_is_no_valley() -> None:
    omegas = np.array([1.0, 2.0, 3.0, 4.0])
    gain = np.exp(np.array([[1.0, 2.0, 3.0, 4.0], [nan, 1.0, 2.0, 3.0], [nan] * 4, [4.0, 1.0, 0.0, 1.0]]))
    np.testing.assert_allclose(least_over_omega(omegas, gain), [nan, nan, nan, 3.0], atol=1e-9)


def test_contours_become_finer_where_the_usual_levels_are_few() -> None:
    usual = (0.1, 0.5, 1.0, 2.0, 5.0)
    assert levels_for(np.array([0.05, 3.0, nan]), usual) == [0.1, 0.5, 1.0, 2.0]
    np.testing.assert_allclose(levels_for(np.array([1.19, 1.61]), usual), [1.2, 1.3, 1.4, 1.5, 1.6], atol=1e-9)
    assert levels_for(np.array([0.7, 0.7]), usual) == [0.7]


@pytest.mark.parametrize(
    ("command", "panels"),
    [
        (["modes"], 14),
        (["modes", "--beta", "0.1:1:10"], 2),
        (["history", "--omega", "16", "--duration", "4"], 3),
        (["history", "--steady", "--omega", "18.5", "--beta", "0.25"], 6),
        (["steady", "--omega", "18.5", "--beta", "0.25"], 6),
        (["spectrum", "--omega", "16:18:9"], 3),
        (["map", "--omega", "16:21:6", "--beta", "0.1:0.5:5"], 6),
    ],
)
def test_every_prediction_draws_its_figure(
    command: list[str], panels: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[Figure] = []

    def keep(path: Path, figure: Figure) -> None:
        drawn.append(figure)
        write_figure(path, figure)

    monkeypatch.setattr("bench.figures.style.write_figure", keep)
    assert main(["predict", *command, "--plot", str(tmp_path / "figure.png")]) == 0
    assert len(drawn[0].axes) == panels
    image = imread(tmp_path / "figure.png")
    width, height = drawn[0].get_size_inches() * 200
    assert image.shape[:2] == (round(height), round(width))


@pytest.mark.parametrize(("suffix", "begin"), [("png", b"\x89PNG"), ("pdf", b"%PDF"), ("svg", b"<?xml")])
def test_the_suffix_names_the_format_and_no_figure_is_overwritten(tmp_path: Path, suffix: str, begin: bytes) -> None:
    path = tmp_path / f"figure.{suffix}"
    write_figure(path, new_figure(2.0, 2.0))
    assert path.read_bytes().startswith(begin)
    with pytest.raises(InvalidInput, match="never overwritten"):
        write_figure(path, new_figure(2.0, 2.0))
    assert [each.name for each in tmp_path.iterdir()] == [path.name]


def test_the_modulus_of_multipliers_is_drawn_by_ground_with_its_boundaries() -> None:
    points = {
        "beta": np.array([0.4, 0.4]),
        "omega_rad_s": np.array([15.0, 16.0]),
        "modulus": np.array([0.99, 1.02]),
        "table_modulus": np.array([0.97, 0.98]),
    }
    boundaries = {"beta": np.array([0.4]), "ground": np.array(["fixed ground"]), "omega_rad_s": np.array([15.4])}
    (panel,) = stability_figure(points, boundaries).axes
    # a growing motion does not decay slowly: the modulus is the largest, whatever its size
    assert panel.get_ylabel() == r"largest modulus  $|\mu|$"
    drawn = {line.get_label(): line.get_ydata() for line in panel.lines}
    np.testing.assert_array_equal(drawn["fixed ground"], points["modulus"])
    np.testing.assert_array_equal(drawn["table"], points["table_modulus"])
