"""How dark a page is where something is drawn on it, in the page's own axes.

Darkness is what is missing of the paper's brightness around it, 0 to 1: a scanner does not light a page evenly. The
paper's brightness is the median of each block of 5 mm.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.limits import refuse_beyond
from truearm.measurement.drawn_circle.page import Page
from truearm.modeling.chain import Array

#: Edge of a block of paper, and of the dots in which lines are looked for [m].
_BLOCK: Final = 5e-3
_COARSE: Final = 0.2e-3
#: What is darker than this share of the page's usual paper is a filled area and no paper.
_DARKEST_PAPER: Final = 0.6
#: Darkness that is no ink, nor noise larger than usual.
_FAINTEST: Final = 0.08
_NOISE: Final = 5.0
_ROWS_AT_ONCE: Final = 256


@dataclass(frozen=True, eq=False)
class Ink:
    """Darkness of a page; x right, y up, from its lower left corner."""

    brightness: NDArray[np.uint8] | Array  #: ``(rows, columns)``, the uppermost row first.
    pitch: tuple[float, float]  #: Distance of dots along x and y [m].
    #: Width and height of the page [m]; the dots may leave a rest of less than a dot at the right and below.
    size: tuple[float, float]
    paper: Array  #: Brightness of the paper ``(rows, columns)``, in blocks.
    block: tuple[float, float]  #: Edges of a block in dots, along x and y.

    def at(self, x: Array, y: Array) -> Array:
        """Return the darkness at points [m] between dots, 0 beyond the page; ``(rays, points)``, short rays."""
        from scipy.ndimage import map_coordinates

        columns, rows = x / self.pitch[0] - 0.5, (self.size[1] - y) / self.pitch[1] - 0.5
        bright = map_coordinates(self.brightness, [rows, columns], output=np.float64, order=1, mode="nearest")
        inside = (x >= 0) & (x <= self.size[0]) & (y >= 0) & (y <= self.size[1])
        middle = slice(x.shape[1] // 2, x.shape[1] // 2 + 1)
        return np.where(inside, 1 - bright / self._paper_at(rows[:, middle], columns[:, middle]), 0.0)

    def everywhere(self) -> Array:
        """Return the darkness of all dots, ``(rows, columns)``."""
        made = np.empty(self.brightness.shape)
        for first in range(
            0, len(made), _ROWS_AT_ONCE
        ):  # the places of all dots would take much more memory than these
            part = self.brightness[first : first + _ROWS_AT_ONCE]
            rows, columns = (np.asarray(places, dtype=np.float64) for places in np.indices(part.shape))
            made[first : first + _ROWS_AT_ONCE] = 1 - part / self._paper_at(rows + first, columns)
        return made

    def _paper_at(self, rows: Array, columns: Array) -> Array:
        from scipy.ndimage import map_coordinates

        blocks = [(rows + 0.5) / self.block[1] - 0.5, (columns + 0.5) / self.block[0] - 0.5]
        return np.asarray(map_coordinates(self.paper, blocks, output=np.float64, order=1, mode="nearest"))


def ink_of(page: Page) -> tuple[Ink, Ink]:
    """Return the ink of a page in its own dots, and in dots of 0.2 mm at most."""
    from scipy.ndimage import median_filter

    x, y = (max(1, int(_COARSE / pitch)) for pitch in page.pitch)
    refuse_beyond("dots", (page.brightness.shape[0] // y) * (page.brightness.shape[1] // x), where=page.source)
    coarse = _blocks(page.brightness, x, y).mean(axis=(1, 3), dtype=np.float64)
    pitch = (x * page.pitch[0], y * page.pitch[1])
    across, along = (max(1, round(_BLOCK / edge)) for edge in pitch)
    paper = median_filter(np.median(_blocks(coarse, across, along), axis=(1, 3)), size=3, mode="nearest")
    paper = np.maximum(paper, max(_DARKEST_PAPER * float(np.median(paper)), 1.0))
    block = (float(across), float(along))
    return (
        Ink(page.brightness, page.pitch, page.size, paper, (block[0] * x, block[1] * y)),
        Ink(coarse, pitch, page.size, paper, block),
    )


def faintest(darkness: Array) -> float:
    """Return the darkness above which a dot is inked and not the paper's noise."""
    noise = 1.4826 * float(np.median(np.abs(darkness - np.median(darkness))))
    return max(_FAINTEST, _NOISE * noise)


def _blocks(values: NDArray[np.uint8] | Array, across: int, along: int) -> NDArray[np.uint8] | Array:
    """Return a view ``(rows, along, columns, across)`` of whole blocks."""
    rows, columns = values.shape[0] // along, values.shape[1] // across
    return values[: rows * along, : columns * across].reshape(rows, along, columns, across)
