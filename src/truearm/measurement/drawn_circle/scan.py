"""The drawn circle on a scanned page: its centre, radius and profile."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError
from truearm.measurement.drawn_circle.candidates import Candidate, candidates, lines, thresholds
from truearm.measurement.drawn_circle.ink import Ink, ink_of
from truearm.measurement.drawn_circle.line import Line, follow
from truearm.measurement.drawn_circle.page import read_page
from truearm.modeling.chain import Array

_SECTORS: Final = (90, 3600)
#: Lines whose circles are nearer together than this are one [m].
_SAME_CIRCLE: Final = 1e-3
#: Share of the turn over which something else may be drawn within 3.5 mm.
_LARGEST_DOUBLE_SHARE: Final = 0.1
#: How far from the circle its line is looked for in the end, at most [m]; and as a share of the radius.
_SEARCH_REACH: Final = (4e-3, 0.25)
#: How near the edge of the page a line is cut [m].
_MARGIN: Final = 0.5e-3
#: Brightness of the darkest page that can be read.
_DARKEST_PAGE: Final = 64.0


@dataclass(frozen=True, eq=False)
class ScannedCircle:
    """A circle as it was drawn."""

    source: str  #: The scanned file.
    centre: Array  #: Of the circle of least squares [m], ``(2,)``: x right and y up, from the page's lower left corner.
    radius: float  #: Of that circle [m].
    #: Directions from the centre, from the page's x towards y [rad], ``(n,)``, evenly from 0 to below 2 pi.
    angle: Array
    #: Distance from the centre to the middle of the line in each direction [m], ``(n,)``; NaN where the line is missing
    #: or cannot be told.
    profile: Array

    @property
    def missing(self) -> NDArray[np.bool_]:
        """In which directions there is no line, ``(n,)``."""
        return np.isnan(self.profile)

    @property
    def roundness(self) -> float:
        """Largest less smallest distance from the centre of least squares [m] (ISO 12181-1, RONt)."""
        return float(np.nanmax(self.profile) - np.nanmin(self.profile))


def read_circle(path: Path, dpi: float | tuple[float, float] | None = None, sectors: int = 360) -> ScannedCircle:
    """Find the one circle that is drawn on a scanned page.

    Specks, writing and straight lines elsewhere, a grid fainter than the line, and gaps are left aside. The line's
    width does not matter: its middle counts.

    Args:
        path: PNG, JPEG or TIFF of one page.
        dpi: Dots per inch, along x and y if they differ; what the file says if None.
        sectors: Number of directions in which the line is read, each the mean over its sector; 90 to 3600.

    Raises:
        InputError: If the file is no such page or does not say its resolution; if nothing is drawn on it, or no circle,
            one that the page's edge cuts, several, or one with something else along it.
    """
    if not _SECTORS[0] <= sectors <= _SECTORS[1]:
        raise InputError(
            "the number of sectors is out of range",
            where="sectors",
            came=sectors,
            allowed=f"{_SECTORS[0]} to {_SECTORS[1]}",
        )
    page = read_page(path, dpi)
    ink, coarse = ink_of(page)
    if float(np.median(coarse.brightness)) < _DARKEST_PAGE:
        raise InputError(
            "the page is dark", where=str(path), cure="Draw on white paper, and scan without turning it to a negative."
        )
    found, threshold = _found(coarse, str(path))
    if len(found) > 1:
        raise InputError(
            "several circles are drawn on the page",
            where=str(path),
            came=", ".join(_words(line) for line in found[:2]),
            allowed="one",
            cure="Scan a page with one of them, or paint the others over with white.",
        )
    (line,) = found
    if line.beside > _LARGEST_DOUBLE_SHARE:
        raise InputError(
            "another line, or writing, runs along the circle, or its line is not clear",
            where=str(path),
            came=f"{_words(line)}, with something beside it over {line.beside:.0%} of the turn",
            cure="Draw one circle, once, on clean paper.",
        )
    room = min(*line.centre, *(np.array(page.size) - line.centre))
    if room < line.radius + _MARGIN:
        raise InputError(
            "the circle is cut by the edge of the page",
            where=str(path),
            came=f"{_words(line)}, and the page ends {1e3 * room:.1f} mm from its centre",
            cure="Lay the whole circle onto the scanner, or draw a smaller one.",
        )
    start = Candidate(
        float(line.centre[0]), float(line.centre[1]), line.radius, min(_SEARCH_REACH[0], _SEARCH_REACH[1] * line.radius)
    )
    fine = follow(ink, start, sectors, threshold)
    if fine is None:
        raise _no_circle(str(path))
    return ScannedCircle(
        source=str(path),
        centre=fine.centre,
        radius=fine.radius,
        angle=2 * math.pi * np.arange(sectors) / sectors,
        profile=fine.profile,
    )


def _found(coarse: Ink, where: str) -> tuple[list[Line], float]:
    """Return the different circles on a page and the darkness above which they are inked, or refuse."""
    darkness = coarse.everywhere()
    drawn = False
    for threshold in thresholds(darkness):
        thinned = lines(darkness, coarse.pitch, threshold)
        drawn = drawn or bool(thinned.any())
        found: list[Line] = []
        for candidate in candidates(thinned, coarse):
            line = follow(coarse, candidate, 360, threshold)
            if line is not None and all(_distance(line, other) > _SAME_CIRCLE for other in found):
                found.append(line)
        if found:
            return found, threshold
    if not drawn:
        raise InputError(
            "nothing is drawn on the page but specks or letters",
            where=where,
            cure="Check that the drawn side was scanned, and use a soft pencil or a pen.",
        )
    raise _no_circle(where)


def _no_circle(where: str) -> InputError:
    return InputError(
        "there is no circle on the page",
        where=where,
        allowed="a line over at least half a turn, round to 4 % of its radius, of 5 mm radius or more",
        cure="Check that the whole circle is on the page and its line is darker than grid and writing.",
    )


def _distance(line: Line, other: Line) -> float:
    return float(np.hypot(*(line.centre - other.centre))) + abs(line.radius - other.radius)


def _words(line: Line) -> str:
    x, y = 1e3 * line.centre
    return f"radius {1e3 * line.radius:.1f} mm about x {x:.1f}, y {y:.1f} mm"
