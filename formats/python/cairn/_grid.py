"""The integer grid that all positions of a dataset lie on, and boxes in world coordinates."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._errors import UsageError


class Grid(NamedTuple):
    """Positions are int32 steps; on each axis ``world = offset + step * (i + shift)``."""

    step: tuple[float, float, float]
    """World units a step."""
    offset: tuple[float, float, float]
    """World units."""
    shift: tuple[int, int, int]
    """Steps."""

    def world(self, steps: ArrayLike) -> NDArray[np.float64]:
        """World coordinates of steps, (n, 3) both. The sum in brackets is exact, the rest rounded to nearest."""
        given = np.asarray(steps)
        with np.errstate(invalid="ignore"):
            exact = np.ascontiguousarray(given, dtype=np.int32)
        if exact is not given and not np.array_equal(exact, given):
            raise UsageError("steps are whole numbers of 32 bits")
        return _core.to_world(exact, *self)


def as_box(box: ArrayLike) -> NDArray[np.float64]:
    """A box as (2, 3) float64, least corner first; of two coordinates it has no end along z."""
    try:
        corners = np.array(box, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise UsageError(f"a box is two corners of numbers: {error}") from None
    if corners.shape == (2, 2):
        corners = np.column_stack([corners, [-np.inf, np.inf]])
    if corners.shape != (2, 3):
        raise UsageError(f"a box is two corners of two or three coordinates: found an array of shape {corners.shape}")
    if not (corners[0] <= corners[1]).all():
        raise UsageError(f"a box begins with its least corner: found {corners[0].tolist()} to {corners[1].tolist()}")
    return corners


def meets(boxes: NDArray[Any], box: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which of many boxes, (n, 2, 3), have a point in common with one; the sides belong to a box."""
    met: NDArray[np.bool_] = ((boxes[:, 0] <= box[1]) & (boxes[:, 1] >= box[0])).all(axis=1)
    return met


def holds(box: NDArray[np.float64], boxes: NDArray[Any]) -> NDArray[np.bool_]:
    """Which of many boxes lie in one as a whole."""
    held: NDArray[np.bool_] = ((boxes[:, 0] >= box[0]) & (boxes[:, 1] <= box[1])).all(axis=1)
    return held


def inside(box: NDArray[np.float64], xyz: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which of many points, (n, 3), lie in a box, sides included."""
    found: NDArray[np.bool_] = ((xyz >= box[0]) & (xyz <= box[1])).all(axis=1)
    return found
