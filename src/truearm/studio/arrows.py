"""Errors as arrows, magnified so that they can be seen, and coloured by their size."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.arrays import finite_number
from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array

#: How much errors may be magnified.
FACTORS: Final = (1.0, 2000.0)
#: From small to large, in even steps of colour (CIELAB) and each lighter than the one before: blue, green, yellow. All
#: stand out from white and from the dark window by a contrast of 3 or more.
_COLOURS: Final = np.array(
    [[28, 107, 176], [10, 122, 155], [12, 138, 134], [20, 152, 106], [88, 155, 67], [137, 152, 30], [181, 144, 15]],
    float,
)


@dataclass(frozen=True, eq=False)
class Arrows:
    """Arrows to draw."""

    segments: Array  #: Start and end of each [m], ``(n, 2, 3)``.
    colours: NDArray[np.uint8]  #: ``(n, 3)``, 0 to 255.
    words: str  #: What must stand beside them: how much they are magnified, and how large the largest is.


def error_arrows(points: Array, errors: Array, factor: float, lightest: float | None = None) -> Arrows:
    """Return arrows of errors, at the points where they were found.

    Args:
        points, errors: ``(n, 3)`` [m]; rows with a NaN are left out.
        factor: By how much they are magnified, 1 to 2000.
        lightest: Size that has the lightest colour [m]; None for the largest of them.

    Raises:
        InputError: If the factor is beyond that.
    """
    times = finite_number(factor, "factor")
    if not FACTORS[0] <= times <= FACTORS[1]:
        raise InputError("errors are not magnified by that", parameter="factor", came=factor, allowed="1 to 2000")
    seen = np.isfinite(points).all(axis=1) & np.isfinite(errors).all(axis=1)
    at, by = points[seen], errors[seen]
    size = np.linalg.norm(by, axis=1)
    largest = float(size.max(initial=0.0))
    colours = coloured(size, 0.0, largest if lightest is None else lightest)
    words = f"errors x {times:g}, largest {largest * 1e3:.3g} mm"
    return Arrows(np.stack([at, at + times * by], axis=1), colours, words)


def coloured(values: Array, low: float, high: float) -> NDArray[np.uint8]:
    """Return the colours of values ``(n,)`` between two others, ``(n, 3)``."""
    share = np.clip((values - low) / (high - low), 0.0, 1.0) if high > low else np.zeros(len(values))
    steps = np.linspace(0.0, 1.0, len(_COLOURS))
    return np.stack([np.interp(share, steps, channel) for channel in _COLOURS.T], axis=1).astype(np.uint8)
