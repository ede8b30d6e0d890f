"""The picture: measured frame, modelled block, and how large the motion is drawn."""

from math import pi, sin

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from bench.app.display import texts
from bench.app.display.buffers import BEHIND, STEP, BlockAngle
from bench.app.display.picture import FACTOR, FLASH, Outline, Pose
from bench.app.display.status import Arrangement
from bench.app.display.theme import LIGHT
from bench.app.gui.picture import LARGEST, PhysicalPicture
from bench.app.ipc.messages import TRACES, Traces
from bench.events import SpecimenMounted
from drivers.rig import OperatorTask
from sim import block_face
from sim.excitation import SampledRecord
from sim.rocking import simulate
from sim.specimen import Specimen
from tests.bench.twin.twin_bench import estimate

COUPLED = Specimen().coupled(0.4)


def _traces(run: int, origin: float) -> Traces:
    still = np.zeros((50, len(TRACES)), np.float32)
    return Traces(run, origin, 0.002, still, still, 0.0, origin)


def test_the_block_moves_as_the_twin_says_and_is_shown_at_the_moment_it_is_for() -> None:
    """Against the integration of the whole record that the twin's trace was taken from."""
    time = STEP * np.arange(300)
    acceleration = 1.3 * COUPLED.uplift_acceleration * np.sin(16.0 * time) * np.minimum(time, 1.0)
    expected = simulate(COUPLED, SampledRecord(acceleration, STEP), sample_times=time).samples
    assert expected is not None
    assert np.abs(expected[:, 4]).max() > 0.01, "it rocks"
    trace = np.column_stack((time, expected[:, [0, 1, 4]], np.zeros((time.size, 2))))
    block = BlockAngle()
    block.add(estimate(run=1, trace=trace[:10]))
    assert block.at(7.05) is None, "nothing is known of when that run began"
    block.place(_traces(1, 7.0))
    for first in range(0, 300, 10):
        block.add(estimate(run=1, trace=trace[first : first + 10]))
    end = 7.0 + float(time[-1])
    assert block.nearest(end + 1.0) == pytest.approx(end)
    assert block.nearest(end + BEHIND + 1.0) == end + BEHIND + 1.0
    crossings = np.flatnonzero(np.sign(expected[1:, 4]) != np.sign(expected[:-1, 4])) + 1
    for k in range(150, 300, 7):
        found = block.at(7.0 + STEP * k + 1e-6)
        assert found is not None
        assert found[0] == pytest.approx(expected[k, 4])
        since = STEP * (k - crossings[crossings <= k].max())
        assert found[1] == pytest.approx(since, abs=1e-5)
    # a block that has fallen, and another run, are not known
    fallen = trace[:10].copy()
    fallen[:, 0] += 3.0
    fallen[:, 3] = np.nan
    block.add(estimate(run=1, trace=fallen))
    assert block.at(10.05) is None
    block.place(_traces(2, 95.0))
    block.add(estimate(run=1, trace=trace))
    assert block.at(95.05) is None


@pytest.fixture
def picture(qtbot: QtBot) -> PhysicalPicture:
    shown = PhysicalPicture(LIGHT)
    qtbot.addWidget(shown)
    shown.resize(500, 260)
    shown.show()
    return shown


def _motion(**values: float) -> np.ndarray:
    motion = np.zeros(len(TRACES))
    for name, value in values.items():
        motion[TRACES.index(name)] = value
    return motion


def test_motion_is_drawn_larger_by_key_wheel_and_field(picture: PhysicalPicture, qtbot: QtBot) -> None:
    picture.use(COUPLED)
    picture.show_arrangement(Arrangement(block=True, spring=True))
    picture.move_to(_motion(displacement=0.01, u1=0.002, u2=-0.003), (0.02, 1.0))
    pose = picture.pose
    assert (pose.ground, pose.first, pose.second, pose.angle) == pytest.approx((0.05, 0.01, -0.015, 0.1))
    assert picture.source.text() == texts.FRAME_AND_BLOCK
    qtbot.keyClick(picture.canvas, Qt.Key.Key_Plus)
    assert picture.factor.value() == FACTOR + 1
    qtbot.keyClick(picture.canvas, Qt.Key.Key_Minus)
    at = QPointF(10, 10)
    turn = QWheelEvent(
        at, at, QPoint(), QPoint(0, 120), Qt.MouseButton.NoButton, Qt.KeyboardModifier.NoModifier,
        Qt.ScrollPhase.NoScrollPhase, False,
    )  # fmt: skip
    QApplication.sendEvent(picture.canvas, turn)
    assert picture.pose.ground == pytest.approx(0.06)
    picture.factor.setValue(LARGEST + 10)
    assert picture.factor.value() == LARGEST


def test_contact_impact_and_what_is_not_known_look_different(picture: PhysicalPicture) -> None:
    picture.use(COUPLED)

    def drawn(block: tuple[float, float] | None, coupled: bool = True) -> bytes:
        picture.show_arrangement(Arrangement(block=coupled, spring=coupled))
        picture.move_to(_motion(u1=0.001), block)
        # the bits are valid only while the image exists
        image = picture.canvas.grab().toImage()
        return bytes(image.constBits())

    looks = [
        drawn(None, coupled=False),
        drawn(None),
        drawn((0.0, 9.0)),
        drawn((0.02, 9.0)),
        drawn((-0.02, 9.0)),
        drawn((-0.02, 0.5 * FLASH)),
    ]
    assert len(set(looks)) == len(looks)
    assert drawn((0.02, 9.0)) == looks[3]
    # a block that has fallen is drawn on its side at most
    assert len(drawn((pi, 9.0))) == len(looks[0])


@pytest.mark.parametrize("angle", [0.2, -0.2])
def test_the_block_turns_about_the_corner_it_stands_on(angle: float) -> None:
    """Against a rotation by complex numbers: theta > 0 about the corner on the frame's side, the top towards it."""
    arrangement = Arrangement(block=True, spring=True)
    rest, turned = (
        np.array([complex(*at) for at in shape.points])
        for pose in (Pose(angle=0.0), Pose(angle=angle))
        for shape in Outline(COUPLED).shapes(pose, arrangement)
        if shape.role == "block"
    )
    lower_left, lower_right = rest[0], rest[1]
    corner = lower_left if angle > 0.0 else lower_right
    np.testing.assert_allclose(turned, corner + (rest - corner) * np.exp(1j * angle), atol=1e-12)
    assert (turned[2:].real < rest[2:].real).all() == (angle > 0.0)
    assert turned.imag.min() == pytest.approx(corner.imag), "no part of it is below the table"


def test_each_beam_ends_on_what_its_laser_measures() -> None:
    frame, pose = COUPLED.frame, Pose(ground=0.01, first=0.02, second=-0.03, angle=0.1)
    for face in (None, 0.3):
        outline = Outline(COUPLED)
        shapes = outline.shapes(pose, Arrangement(block=True, face=face))
        beams = {shape.points[1][1]: shape.points[1] for shape in shapes if shape.role == "beam"}
        storeys = {shape.points[0][1]: shape.points[0] for shape in shapes if shape.role == "storey"}
        assert beams.keys() == {frame.h1, frame.h2 if face is None else face}
        assert beams[frame.h1] == storeys[frame.h1]
        if face is None:
            assert beams[frame.h2] == storeys[frame.h2]
        else:
            foot = next(shape.points[0] for shape in shapes if shape.role == "block")
            assert beams[face] == pytest.approx((foot[0] - face * sin(0.1), face)), "on the turned left face"


def test_without_the_model_it_says_so(picture: PhysicalPicture) -> None:
    picture.use(COUPLED)
    picture.show_arrangement(Arrangement(block=True, spring=True))
    picture.move_to(_motion(), None)
    assert picture.source.text() == texts.FRAME_ONLY
    picture.show_arrangement(Arrangement())
    picture.move_to(_motion(u1=1e-3), None)
    assert picture.source.text() == texts.FRAME


def test_the_picture_follows_what_is_mounted_and_where_laser_2_points(picture: PhysicalPicture) -> None:
    """Free rocking: the displacement of laser 2 is the block's face, and storey 2 is not bent by it."""
    picture.use(COUPLED.bare())
    arrangement, alone, height, tilt = Arrangement(), COUPLED.bare(), 0.3, 0.05
    for work, amount in ((OperatorTask.WATCH_BLOCK, height), (OperatorTask.TILT_BLOCK, tilt)):
        arrangement.follow(SpecimenMounted(alone, work, amount, time=0.0))
    picture.show_arrangement(arrangement)
    block, factor = COUPLED.block, picture.factor.value()
    for angle in (tilt, 0.02, 0.0, -0.03):
        seen = float(block_face.displacement(angle, height, block) - block_face.displacement(tilt, height, block))
        picture.move_to(_motion(u1=1e-4, u2=seen), None)
        assert picture.pose.angle == pytest.approx(factor * angle, abs=1e-9)
        assert picture.pose.second == picture.pose.first
    assert "laser 2, 300 mm" in picture.source.text()
    for work, block_there, spring in (
        (OperatorTask.WATCH_STOREYS, True, False),
        (OperatorTask.MOUNT_SPRING, True, True),
        (OperatorTask.REMOVE_BLOCK, False, False),
        (OperatorTask.HOLD_BLOCK, True, True),
    ):
        arrangement.follow(SpecimenMounted(alone, work, time=0.0))
        assert (arrangement.block, arrangement.spring, arrangement.face) == (block_there, spring, None)
