"""Picture of the specimen: table, frame, spring, block and laser beams as shapes to scale, with magnified motion."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import cos, inf, isfinite, sin
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bench.app.display import texts
from bench.app.display.status import Arrangement
from bench.app.ipc.messages import TRACES
from sim.block_face import displacement, rotation
from sim.specimen import Specimen

FACTOR = 5
"""Initial magnification of the motion."""
COILS, STEEPEST = 9, 1.4
"""Number of zigzag points of the spring; largest drawn angle of the block [rad]."""
FLASH = 0.15
"""Time for which an impact is displayed [s], in bench time."""
X_G, U_1, U_2 = (TRACES.index(name) for name in ("displacement", "u1", "u2"))

Role = Literal["table", "column", "storey", "spring", "beam", "block", "unknown", "contact", "impact"]
Point = tuple[float, float]


@dataclass(frozen=True)
class Shape:
    """A part of the picture: a line through `points` (x, y) [m]. The origin is on the table, midway between frame and
    block at rest; x points to the right and y upwards.

    role : kind of the part, which selects its style. "block" and "unknown" (a block at an unknown angle) are closed;
        "contact" and "impact" have one point, at which a mark is drawn.
    """

    role: Role
    points: tuple[Point, ...]


@dataclass(frozen=True)
class Pose:
    """Drawn displacements [m] of the table and of the storeys relative to it; the block's angle [rad], None if unknown;
    time since its last impact [s].
    """

    ground: float = 0.0
    first: float = 0.0
    second: float = 0.0
    angle: float | None = None
    struck: float = inf


def pose_of(
    motion: NDArray[np.float64],
    block: tuple[float, float] | None,
    arrangement: Arrangement,
    specimen: Specimen,
    factor: float = 1.0,
) -> Pose:
    """Pose at one instant, magnified by `factor`.

    motion : signals `bench.app.ipc.messages.TRACES` in SI units, shape (n_signals,).
    block : modelled angle of the block [rad] and time since its last impact [s]; None if unknown.

    While laser 2 measures the block, the angle follows from the measured displacement, and storey 2 is drawn straight
    above storey 1.
    """
    motion = np.nan_to_num(motion)
    angle, struck = (0.0, inf) if arrangement.block_clamped else block or (None, inf)
    frame = specimen.frame
    first, second = float(motion[U_1]), float(motion[U_2])
    if arrangement.pull:
        # the signals are zero in the pulled position: storey 2 held at `pull`, storey 1 displaced by the static force
        first += frame.k2 / (frame.k1 + frame.k2) * arrangement.pull
        second += arrangement.pull
    if arrangement.face is not None:
        zero = float(displacement(arrangement.tilt, arrangement.face, specimen.block))
        found = float(rotation(zero + second, arrangement.face, specimen.block))
        angle, struck, second = found if isfinite(found) else None, inf, first
    ground = float(motion[X_G])
    return Pose(factor * ground, factor * first, factor * second, None if angle is None else factor * angle, struck)


def source(arrangement: Arrangement, pose: Pose) -> str:
    """Text that states what is clamped, and which parts of the picture are measured, modelled or unknown."""
    clamped = [text for field, text in texts.CLAMPED.items() if getattr(arrangement, field)]
    return " ".join([*clamped, _measured(arrangement, pose)])


def _measured(arrangement: Arrangement, pose: Pose) -> str:
    if arrangement.face is not None:
        return texts.BLOCK_BY_LASER.format(height=1e3 * arrangement.face)
    if not arrangement.block:
        return texts.FRAME
    if arrangement.block_clamped:
        return texts.FRAME_BY_LASERS
    return texts.FRAME_ONLY if pose.angle is None else texts.FRAME_AND_BLOCK


class Outline:
    """Shapes of the picture, from the positions of frame and block at rest [m]."""

    def __init__(self, specimen: Specimen) -> None:
        self.specimen = specimen
        frame, block = specimen.frame, specimen.block
        self.height = 1.1 * max(frame.h2, 2.0 * block.h_b)
        """Height of the picture [m]."""
        self.half = 0.35 * frame.h1 + 0.05
        """Half the width of a storey [m]."""
        self.frame = -self.half - 0.5 * specimen.d
        self.block = self.frame + self.half + specimen.d + block.b
        """Horizontal positions of the centres of frame and block at rest [m]."""
        self.ends = self.frame - 1.6 * self.half, self.block + 2.0 * block.b
        """Horizontal positions of the ends of the table at rest [m]."""

    def shapes(self, pose: Pose, arrangement: Arrangement) -> tuple[Shape, ...]:
        """All parts of the picture."""
        block = self._block(pose, arrangement) if arrangement.block else ()
        return (*self._frame(pose), *self._beams(pose, arrangement), *block)

    def _frame(self, pose: Pose) -> Iterator[Shape]:
        frame, left, half = self.specimen.frame, self.frame + pose.ground, self.half
        yield Shape("table", tuple((end + pose.ground, 0.0) for end in self.ends))
        storeys = ((0.0, 0.0), (pose.first, frame.h1), (pose.second, frame.h2))
        for side in (-half, half):
            yield Shape("column", tuple((left + side + x, y) for x, y in storeys))
        for x, y in storeys[1:]:
            yield Shape("storey", ((left - half + x, y), (left + half + x, y)))

    def _beams(self, pose: Pose, arrangement: Arrangement) -> Iterator[Shape]:
        """Laser beams: to the storeys from the left edge of the picture, to the block from the frame."""
        frame, left = self.specimen.frame, self.frame + pose.ground - self.half
        yield Shape("beam", ((self.ends[0], frame.h1), (left + pose.first, frame.h1)))
        if arrangement.face is None:
            yield Shape("beam", ((self.ends[0], frame.h2), (left + pose.second, frame.h2)))
        elif arrangement.block:
            target = self._turned(pose, self.block - self.specimen.block.b, arrangement.face)[0]
            yield Shape("beam", ((left + 2.0 * self.half, arrangement.face), (target, arrangement.face)))

    def _block(self, pose: Pose, arrangement: Arrangement) -> Iterator[Shape]:
        block, height = self.specimen.block, self.specimen.frame.h1
        left, right, top = self.block - block.b, self.block + block.b, 2.0 * block.h_b
        if arrangement.spring:
            begin, end = self.frame + self.half + pose.ground + pose.first, self._turned(pose, left, height)
            along, up = end[0] - begin, end[1] - height
            shares = [(k + 0.5) / COILS for k in range(COILS)]
            coils = (
                (begin + along * share, height + up * share + (0.012 if k % 2 else -0.012))
                for k, share in enumerate(shares)
            )
            yield Shape("spring", ((begin, height), *coils, end))
        corners = ((left, 0.0), (right, 0.0), (right, top), (left, top))
        turned = tuple(self._turned(pose, x, y) for x, y in corners)
        yield Shape("unknown" if pose.angle is None else "block", turned)
        if pose.angle is None:
            return
        feet = turned[:2] if pose.angle == 0.0 else (turned[0],) if pose.angle > 0.0 else (turned[1],)
        for foot in feet:
            yield Shape("contact", (foot,))
        if pose.struck < FLASH:
            for foot in feet:
                yield Shape("impact", (foot,))

    def _turned(self, pose: Pose, x: float, y: float) -> Point:
        """Position of the point of the block that is at (x, y) at rest. A positive angle is a rotation about the left
        corner, with the top towards the frame. An unknown angle is drawn as zero.
        """
        angle = max(min(pose.angle or 0.0, STEEPEST), -STEEPEST)
        corner = self.block - self.specimen.block.b if angle > 0.0 else self.block + self.specimen.block.b
        x -= corner
        return corner + pose.ground + x * cos(angle) - y * sin(angle), x * sin(angle) + y * cos(angle)
