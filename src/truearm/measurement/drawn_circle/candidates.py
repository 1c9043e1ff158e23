"""Where on a page circles may be: the Hough transform of thinned lines, in cells of about a millimetre.

What is smaller than 5 mm is no part of a circle: specks, letters. Lines are thinned, so that thick ones count as thin
ones do and filled areas hardly at all. Each cell on a line then votes for all centres at all radii (scikit-image,
``hough_circle``); the share of its circumference that lies on lines is a circle's score.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from truearm.measurement.drawn_circle.ink import Ink, faintest
from truearm.modeling.chain import Array

#: Extent of the smallest thing that may be part of a circle [m].
_LARGEST_SPECK: Final = 5e-3
_CELL: Final = 1e-3
_CELLS: Final = 300  # along the page's longer edge at most
#: Smallest radius in cells, largest as a share of the page's shorter edge.
_RADII: Final = (5, 0.6)
#: Share of a candidate's circumference that lies on lines, and how many are looked at.
_LEAST_SCORE: Final = 0.4
_MOST_CANDIDATES: Final = 12
#: Candidates differ by more cells than this.
_LEAST_DISTANCE: Final = 3
#: A page on which more than this share of cells is inked has no lines.
_LARGEST_INKED_SHARE: Final = 0.4


class Candidate(NamedTuple):
    """A circle that may be there [m], and how exactly it is known [m]."""

    x: float
    y: float
    radius: float
    tolerance: float


def thresholds(darkness: Array) -> list[float]:
    """Return what darkness may part the line from the rest, most likely first: Otsu's among inked dots, any ink."""
    from skimage.filters import threshold_otsu

    least = faintest(darkness)
    inked = darkness[darkness > least]
    if len(np.unique(inked)) < 2:
        return [least]
    return [float(threshold_otsu(inked)), least]


def lines(darkness: Array, pitch: tuple[float, float], threshold: float) -> NDArray[np.bool_]:
    """Return which dots are on the middle of a line, specks left out."""
    from scipy.ndimage import find_objects
    from skimage.measure import label
    from skimage.morphology import skeletonize

    pieces = label(darkness > threshold, connectivity=2)
    large = np.zeros(int(pieces.max()) + 1, dtype=bool)
    for number, (rows, columns) in enumerate(find_objects(pieces), 1):
        extent = max((rows.stop - rows.start) * pitch[1], (columns.stop - columns.start) * pitch[0])
        large[number] = extent >= _LARGEST_SPECK
    return np.asarray(skeletonize(large[pieces]), dtype=np.bool_)


def candidates(thinned: NDArray[np.bool_], ink: Ink) -> Iterator[Candidate]:
    """Yield circles that may be there, best first."""
    from scipy.ndimage import binary_dilation
    from skimage.transform import hough_circle

    width, height = ink.size
    cell = max(_CELL, max(width, height) / _CELLS)
    cells = np.zeros((int(height / cell) + 1, int(width / cell) + 1), dtype=bool)
    rows, columns = np.nonzero(thinned)
    cells[((rows + 0.5) * ink.pitch[1] / cell).astype(int), ((columns + 0.5) * ink.pitch[0] / cell).astype(int)] = True
    cells = binary_dilation(cells, np.ones((3, 3), dtype=bool))
    radii = np.arange(_RADII[0], int(_RADII[1] * min(width, height) / cell) + 1)
    if not len(radii) or cells.mean() > _LARGEST_INKED_SHARE:
        return
    scores = np.asarray(hough_circle(cells, radii))
    for _ in range(_MOST_CANDIDATES):
        r, row, column = (int(i) for i in np.unravel_index(np.argmax(scores), scores.shape))
        if scores[r, row, column] < _LEAST_SCORE:
            return
        yield Candidate(
            (column + 0.5) * cell, height - (row + 0.5) * cell, float(radii[r]) * cell, (_LEAST_DISTANCE + 0.5) * cell
        )
        near = tuple(slice(max(0, i - _LEAST_DISTANCE), i + _LEAST_DISTANCE + 1) for i in (r, row, column))
        scores[near] = 0.0
