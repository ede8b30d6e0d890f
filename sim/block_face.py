"""Displacement measured by a horizontal laser on the face of the rotating stand-alone block.

The beam is at height z above the table and hits the face nearest to the frame. A is the base corner below
that face, and B is the other corner, 2b behind A. theta > 0 rotates the block about A, its top towards the frame; the
face is a line through A, and the lit point moves by z tan(theta). theta < 0 rotates the block about B and lifts A: with
the normal n = (cos, -sin)(theta), the points p of the face relative to B satisfy n p = 2b, and the beam meets the face
2b sec(theta) + z tan(theta) in front of B. For both signs, with displacements towards the frame positive:

    D = z tan(theta) + 2b (sec(theta) - 1) [theta < 0],    dD/dtheta = sec^2(theta) (z + 2b min(sin(theta), 0))

D increases with theta while the beam hits the face, and theta follows from D in closed form.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.specimen import Block

Array = NDArray[np.float64]


def displacement(theta: ArrayLike, height: float, block: Block) -> Array:
    """Displacement [m] of the lit point along the beam, towards the frame, at rotations `theta` [rad], any shape.

    `height` is the height of the beam above the table [m]. NaN where the beam passes above or below the face.
    """
    angle = np.asarray(theta, dtype=np.float64)
    sine, cosine = np.sin(angle), np.cos(angle)
    low, high = heights(angle, block)
    lit = (height >= low) & (height <= high)
    # sec - 1 without cancellation
    behind = np.where(angle < 0.0, 2.0 * np.sin(0.5 * angle) ** 2 / cosine, 0.0)
    return np.where(lit, height * sine / cosine + 2.0 * block.b * behind, np.nan)


def heights(theta: ArrayLike, block: Block) -> tuple[Array, Array]:
    """Heights above the table [m] of the lowest and highest point of the face at rotations `theta` [rad], any shape."""
    angle = np.asarray(theta, dtype=np.float64)
    low = np.maximum(-2.0 * block.b * np.sin(angle), 0.0)
    return low, low + 2.0 * block.h_b * np.cos(angle)


def displacement_rate(theta: ArrayLike, height: float, block: Block) -> Array:
    """Derivative of `displacement` [m/rad]; multiplied by the angular velocity, it gives the velocity measured by the
    laser.
    """
    angle = np.asarray(theta, dtype=np.float64)
    return (height + 2.0 * block.b * np.minimum(np.sin(angle), 0.0)) / np.cos(angle) ** 2


def rotation(displacement: ArrayLike, height: float, block: Block) -> Array:
    """Rotation [rad] of the block from the displacement of the lit point [m], any shape; inverse of the function
    `displacement`.

    About A, theta = atan(D / z). About B, |theta| is the solution of (D + 2b) cos|theta| + z sin|theta| = 2b, a
    difference of two angles in the right triangle with legs D + 2b and z. NaN where no rotation gives the displacement.
    """
    seen = np.asarray(displacement, dtype=np.float64)
    width = 2.0 * block.b
    reach = seen + width
    with np.errstate(invalid="ignore"):
        across = np.sqrt(seen * (seen + 2.0 * width) + height * height)
    about_b = np.arctan2(width * height - reach * across, reach * width + height * across)
    return np.where(seen < 0.0, -about_b, np.arctan(seen / height))
