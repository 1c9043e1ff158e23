"""Circles that a robot drew, found on scanned pages: centre, radius and profile."""

from __future__ import annotations

import io
import math
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError
from truearm.engine.base.files import read_bytes
from truearm.engine.base.limits import LIMITS, refuse_beyond
from truearm.engine.base.units import to_si
from truearm.engine.data.circles import fit_circle
from truearm.engine.robot.chain import Array

if TYPE_CHECKING:
    from PIL.Image import Image


_FORMATS: Final = ("PNG", "JPEG", "TIFF")
#: Dots per inch that scanners have. Programs write 72 or 96 where they do not know.
_RESOLUTIONS: Final = (100.0, 4800.0)
#: Shortest edge of a page [m].
_SHORTEST_EDGE: Final = 0.02
_TURNED: Final = (5, 6, 7, 8)  # EXIF orientations in which rows and columns are exchanged


@dataclass(frozen=True, eq=False)
class Page:
    """A page as it was scanned."""

    source: str  #: The file.
    brightness: NDArray[np.uint8]  #: 0 black to 255 white, ``(rows, columns)``, the uppermost row first.
    pitch: tuple[float, float]  #: Distance of dots along x and y [m].

    @property
    def size(self) -> tuple[float, float]:
        """Width and height [m]."""
        rows, columns = self.brightness.shape
        return columns * self.pitch[0], rows * self.pitch[1]


def read_page(path: Path, dpi: float | tuple[float, float] | None = None) -> Page:
    """Read a PNG, JPEG or TIFF of one page.

    Args:
        dpi: Dots per inch, along x and y if they differ; what the file says if None.

    Raises:
        InputError: If the file is no such image, damaged, of several pages, too large or too small, or if nothing says
            its resolution or that is none of a scanner's (100 to 4800).
    """
    image, declared = _opened(path)
    resolution = declared if dpi is None else (dpi if isinstance(dpi, tuple) else (dpi, dpi))
    if resolution is None:
        raise InputError(
            "the file does not say its resolution",
            where=str(path),
            cure="Give the dots per inch of the scan, `dpi`, or scan again and keep the file as the scanner wrote it.",
        )
    if not all(math.isfinite(value) and _RESOLUTIONS[0] <= value <= _RESOLUTIONS[1] for value in resolution):
        raise InputError(
            "this is no resolution of a scan",
            parameter=None if dpi is None else "dpi",
            where=str(path) if dpi is None else None,
            came=" x ".join(f"{value:g} dpi" for value in resolution),
            allowed=f"{_RESOLUTIONS[0]:g} to {_RESOLUTIONS[1]:g} dots per inch",
            cure="Give the dots per inch of the scan, `dpi`." if dpi is None else "Scan at 300 dpi.",
        )
    inch = to_si(1.0, "in")
    page = Page(
        source=str(path), brightness=_brightness(image, path), pitch=(inch / resolution[0], inch / resolution[1])
    )
    if min(page.size) < _SHORTEST_EDGE:
        raise InputError(
            "the page is too small",
            where=str(path),
            came=" x ".join(f"{1e3 * edge:.1f} mm" for edge in page.size),
            allowed=f"{1e3 * _SHORTEST_EDGE:g} mm or more",
            cure="Check the resolution, or scan the whole page.",
        )
    return page


def _opened(path: Path) -> tuple[Image, tuple[float, float] | None]:
    """Return the image, upright, and the resolution along x and y that its file declares."""
    from PIL import Image, ImageOps

    content = read_bytes(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that there are many dots is refused below, by the same count
            image = Image.open(io.BytesIO(content), formats=_FORMATS)
            refuse_beyond("pixels", image.width * image.height, where=str(path))
            pages = getattr(image, "n_frames", 1)
            image.load()
            orientation = image.getexif().get(0x0112, 1)
            declared = image.info.get("dpi")
            upright = ImageOps.exif_transpose(image)
    except InputError:
        raise
    except Image.DecompressionBombError as error:  # beyond twice Pillow's own limit, whatever ours is
        raise InputError(
            f"the image has more than {2 * (Image.MAX_IMAGE_PIXELS or 0) / 1e6:.0f} million dots",
            where=str(path),
            cure=LIMITS["pixels"].cure,
        ) from error
    except Exception as error:  # Pillow's decoders fail in many ways on damaged files
        raise InputError(
            "the file is no image that can be read, or it is damaged",
            where=str(path),
            allowed=", ".join(_FORMATS),
            cure="Scan again and save the page in one of these formats.",
        ) from error
    if pages > 1:
        raise InputError("the file has several pages", where=str(path), came=pages, cure="Save the page on its own.")
    if declared is None:
        return upright, None
    x, y = (float(value) for value in declared)
    return upright, (y, x) if orientation in _TURNED else (x, y)


def _brightness(image: Image, path: Path) -> NDArray[np.uint8]:
    from PIL import Image

    if image.mode.startswith("I;16"):  # Pillow would clip at 255
        return np.asarray(np.asarray(image) // 257, dtype=np.uint8)
    if image.mode in ("I", "F", "LAB"):
        raise InputError(
            "this kind of image holds no brightness that can be read",
            where=str(path),
            came=f"mode {image.mode}",
            cure="Scan in grey or colour, 8 bits.",
        )
    if image.has_transparency_data:
        seen = image if image.mode in ("RGBA", "LA") else image.convert("RGBA")
        page = Image.new("L", image.size, 255)
        page.paste(seen.convert("L"), mask=seen.getchannel("A"))
        return np.asarray(page)
    return np.asarray(image.convert("L"))


# How dark a page is where something is drawn on it, in the page's own axes.
#
# Darkness is what is missing of the paper's brightness around it, 0 to 1: a scanner does not light a page evenly. The
# paper's brightness is the median of each block of 5 mm.

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
        darkness = np.empty(self.brightness.shape)
        for first in range(
            0, len(darkness), _ROWS_AT_ONCE
        ):  # the places of all dots would take much more memory than these
            part = self.brightness[first : first + _ROWS_AT_ONCE]
            rows, columns = (np.asarray(places, dtype=np.float64) for places in np.indices(part.shape))
            darkness[first : first + _ROWS_AT_ONCE] = 1 - part / self._paper_at(rows + first, columns)
        return darkness

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


# Where on a page circles may be: the Hough transform of thinned lines, in cells of about a millimetre.
#
# What is smaller than 5 mm is no part of a circle: specks, letters. Lines are thinned, so that thick ones count as thin
# ones do and filled areas hardly at all. Each cell on a line then votes for all centres at all radii (scikit-image,
# ``hough_circle``); the share of its circumference that lies on lines is a circle's score.

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


# A drawn line followed around a centre: its radius in every sector, at the middle of the ink across its width.
#
# A sector is the mean of rays that lie a dot apart. The ink's middle is a centroid across the line. Its weight grows
# from a third of the line's usual darkness and stays the same above half of it: a faint grid and uneven paper do not
# count, nor does the pencil's grain within the line, and the weight vanishes where the line ends, so that the dots'
# spacing does not show. A sector in which the line is absent, covered, crossed or far from its neighbours is missing.

#: How far the line may be from what its neighbours let expect [m].
_SEARCH_REACH: Final = 1e-3
#: Share of a turn, on either side, that counts as neighbourhood when following and when judging.
_NEIGHBOURHOODS: Final = (1 / 16, 1 / 90)
#: Shares of a line's usual darkness between which the weight grows.
_LEVELS: Final = (1 / 3, 1 / 2)
#: A line that jumps by more from one sector to the next is none [m]; nor one further from a circle than this share.
_LARGEST_JUMP: Final = 0.15e-3
_LARGEST_OUT_OF_ROUND: Final = 0.04
#: Share of the sectors that must be seen.
_LEAST_SECTORS: Final = 0.5
#: The centre is found when it moves by a smaller share of a dot; it does so at the second or third look.
_CENTRE_SETTLED: Final = 0.02
_MOST_LOOKS: Final = 5


@dataclass(frozen=True, eq=False)
class Line:
    """A line around a centre."""

    centre: Array  #: Of the circle of least squares [m], ``(2,)``.
    radius: float  #: Of that circle [m].
    profile: Array  #: Distance of the line from the centre in each sector [m], NaN where missing, ``(sectors,)``.
    beside: float  #: Share of the sectors in which something else is drawn nearby.


def follow(ink: Ink, start: Candidate, sectors: int, threshold: float) -> Line | None:
    """Follow the line near a circle, or return None where there is none.

    Args:
        start: Circle nearby, and how far from it to look.
        sectors: Their number; the first is centred on the page's x axis.
        threshold: Darkness of what is inked.
    """
    centre, radius, reach = np.array([start.x, start.y]), start.radius, start.tolerance
    for _ in range(_MOST_LOOKS):
        radii, rays = _rays(ink, centre, radius, reach, sectors)
        profile, width = _middle(radii, rays, threshold)
        seen = np.isfinite(profile)
        if seen.sum() < _LEAST_SECTORS * sectors:
            return None
        angle = 2 * math.pi * np.flatnonzero(seen) / sectors
        points = np.stack([profile[seen] * np.cos(angle), profile[seen] * np.sin(angle), np.zeros(len(angle))], axis=1)
        circle = fit_circle(points)
        centre, radius = centre + circle.centre[:2], circle.radius
        if np.hypot(*circle.centre[:2]) < _CENTRE_SETTLED * min(ink.pitch):
            break
    if math.sqrt(float(circle.radial @ circle.radial) / len(angle)) > _LARGEST_OUT_OF_ROUND * radius:
        return None
    own = np.abs(radii - np.where(seen, profile, np.inf)[:, None]) <= width
    beside = (np.where(own, 0.0, rays) > threshold).any(axis=1)
    return Line(centre=centre, radius=radius, profile=profile, beside=float(beside.mean()))


def _rays(ink: Ink, centre: Array, radius: float, reach: float, sectors: int) -> tuple[Array, Array]:
    """Return radii [m] and the darkness there in each sector, ``(sectors, radii)``."""
    from scipy.ndimage import gaussian_filter1d

    dot = min(ink.pitch)
    radii = np.arange(max(radius - reach, dot), radius + reach, dot / 2)
    parts = max(1, math.ceil(2 * math.pi * radius / sectors / dot))
    turn = (np.arange(sectors * parts) - (parts - 1) / 2) * (2 * math.pi / (sectors * parts))
    x = centre[0] + np.cos(turn)[:, None] * radii
    y = centre[1] + np.sin(turn)[:, None] * radii
    rays = ink.at(x, y).reshape(sectors, parts, len(radii)).mean(axis=1)
    return radii, gaussian_filter1d(rays, 2.0, axis=1, mode="nearest")


def _middle(radii: Array, rays: Array, threshold: float) -> tuple[Array, float]:
    """Return the radius of the line's middle in each sector, NaN where missing, and the line's width [m].

    All is missing where less than half of the sectors have a line, or it jumps.
    """
    sectors = len(rays)
    nothing = np.full(sectors, np.nan), 0.0
    first = np.where(rays.max(axis=1) > threshold, radii[rays.argmax(axis=1)], np.nan)
    if np.isfinite(first).sum() < _LEAST_SECTORS * sectors:
        return nothing
    near = np.abs(radii - _smooth(first, _NEIGHBOURHOODS[0])[:, None]) <= _SEARCH_REACH
    at = np.where(near, rays, -1.0).argmax(axis=1)
    darkest = rays[np.arange(sectors), at]
    if not (darkest > threshold).any():
        return nothing
    place = np.arange(len(radii))
    usual = _smooth(np.where(darkest > threshold, darkest, np.nan), _NEIGHBOURHOODS[0])[:, None]
    light = rays < _LEVELS[0] * usual
    left = np.where(light & (place < at[:, None]), place, -1).max(axis=1)
    right = np.where(light & (place > at[:, None]), place, len(radii)).min(axis=1)
    run = (place > left[:, None]) & (place < right[:, None])
    weights = np.where(run, np.minimum(rays, _LEVELS[1] * usual) - _LEVELS[0] * usual, 0.0)
    is_line = (darkest > np.maximum(threshold, _LEVELS[0] * usual[:, 0])) & (left >= 0) & (right < len(radii))
    if is_line.sum() < _LEAST_SECTORS * sectors:
        return nothing
    profile = np.where(is_line, weights @ radii / np.where(is_line, weights.sum(axis=1), 1.0), np.nan)
    step = radii[1] - radii[0]
    widths = (right - left - 1) * step
    width = float(np.median(widths[is_line]))
    profile[widths > 2 * width + 4 * step] = np.nan
    off = np.abs(profile - _smooth(profile, _NEIGHBOURHOODS[1]))
    spread = 1.4826 * float(np.nanmedian(off))
    if spread > _LARGEST_JUMP:
        return nothing
    profile[off > max(width / 2, 4 * spread)] = np.nan
    return profile, width


def _smooth(profile: Array, around: float) -> Array:
    """Return the running median of a profile, over a share of a turn on either side."""
    sectors = len(profile)
    seen = np.flatnonzero(np.isfinite(profile))
    whole = np.interp(np.arange(sectors), seen, profile[seen], period=sectors)
    half = max(2, round(around * sectors))
    neighbours = np.arange(sectors)[:, None] + np.arange(-half, half + 1)
    return np.asarray(np.median(whole[neighbours % sectors], axis=1))


_SECTORS: Final = (90, 3600)
#: Lines whose circles are nearer together than this are one [m].
_SAME_CIRCLE: Final = 1e-3
#: Share of the turn over which something else may be drawn within 3.5 mm.
_LARGEST_DOUBLE_SHARE: Final = 0.1
#: How far from the circle its line is looked for in the end, at most [m]; and as a share of the radius.
_SEARCH_REACH_SCAN: Final = (4e-3, 0.25)
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
    circles, threshold = _circles_on(coarse, str(path))
    if len(circles) > 1:
        raise InputError(
            "several circles are drawn on the page",
            where=str(path),
            came=", ".join(_words(line) for line in circles[:2]),
            allowed="one",
            cure="Scan a page with one of them, or paint the others over with white.",
        )
    (line,) = circles
    if line.beside > _LARGEST_DOUBLE_SHARE:
        raise InputError(
            "another line, or writing, runs along the circle, or its line is not clear",
            where=str(path),
            came=f"{_words(line)}, with something beside it over {line.beside:.0%} of the turn",
            cure="Draw one circle, once, on clean paper.",
        )
    margin = min(*line.centre, *(np.array(page.size) - line.centre))
    if margin < line.radius + _MARGIN:
        raise InputError(
            "the circle is cut by the edge of the page",
            where=str(path),
            came=f"{_words(line)}, and the page ends {1e3 * margin:.1f} mm from its centre",
            cure="Lay the whole circle onto the scanner, or draw a smaller one.",
        )
    start = Candidate(
        float(line.centre[0]),
        float(line.centre[1]),
        line.radius,
        min(_SEARCH_REACH_SCAN[0], _SEARCH_REACH_SCAN[1] * line.radius),
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


def _circles_on(coarse: Ink, place: str) -> tuple[list[Line], float]:
    """Return the different circles on a page and the darkness above which they are inked, or refuse."""
    darkness = coarse.everywhere()
    drawn = False
    for threshold in thresholds(darkness):
        thinned = lines(darkness, coarse.pitch, threshold)
        drawn = drawn or bool(thinned.any())
        circles: list[Line] = []
        for candidate in candidates(thinned, coarse):
            line = follow(coarse, candidate, 360, threshold)
            if line is not None and all(_distance(line, other) > _SAME_CIRCLE for other in circles):
                circles.append(line)
        if circles:
            return circles, threshold
    if not drawn:
        raise InputError(
            "nothing is drawn on the page but specks or letters",
            where=place,
            cure="Check that the drawn side was scanned, and use a soft pencil or a pen.",
        )
    raise _no_circle(place)


def _no_circle(place: str) -> InputError:
    return InputError(
        "there is no circle on the page",
        where=place,
        allowed="a line over at least half a turn, round to 4 % of its radius, of 5 mm radius or more",
        cure="Check that the whole circle is on the page and its line is darker than grid and writing.",
    )


def _distance(line: Line, other: Line) -> float:
    return float(np.hypot(*(line.centre - other.centre))) + abs(line.radius - other.radius)


def _words(line: Line) -> str:
    x, y = 1e3 * line.centre
    return f"radius {1e3 * line.radius:.1f} mm about x {x:.1f}, y {y:.1f} mm"


#: More than a sprung pencil gives way [m], and more than two turns [rad]: other units were meant.
_TRAVEL: Final = 0.05
_TURNS: Final = 4 * math.pi


@dataclass(frozen=True, eq=False)
class DrawnCircle:
    """Where the pencil's point was, in the frame at the centre of the circle with its z out of the paper."""

    source: str  #: The scanned file.
    joints: Array  #: Joint positions [rad or m], ``(n, joints)``.
    angle: Array  #: Direction from the centre [rad], ``(n,)``.
    radius: Array  #: Distance from the centre in the plane of the paper [m], ``(n,)``; NaN where the line is missing.
    height: Array  #: Over the paper [m], ``(n,)``.

    @property
    def distance(self) -> Array:
        """Distance from the centre of the circle [m], ``(n,)``; NaN where the line is missing."""
        return np.hypot(self.radius, self.height)


def drawn_circle(scan: ScannedCircle, angle: Array, joints: Array, height: Array) -> DrawnCircle:
    """Put scan and potentiometer together, configuration by configuration.

    Args:
        scan: The circle on the page.
        angle: At which directions of the circle the robot was read [rad], ``(n,)``, from the page's x towards y. A
            degree of error matters little: it moves a radius by its slope only.
        joints: Joint positions there [rad or m], ``(n, joints)``.
        height: Of the tool over the paper by the potentiometer, along the pencil [m], ``(n,)``.

    Raises:
        InputError: If the arrays do not belong together, are not finite or in other units, or the line is missing at
            every angle.
    """
    angle, joints, height = (np.asarray(values, dtype=np.float64) for values in (angle, joints, height))
    if angle.ndim != 1 or not len(angle) or height.shape != angle.shape or joints.ndim != 2 or not joints.shape[1]:
        raise InputError(
            "angles, joint positions and heights do not belong together",
            came=", ".join(str(values.shape) for values in (angle, joints, height)),
            allowed="(n,), (n, joints) and (n,)",
        )
    if len(joints) != len(angle):
        raise InputError(
            "there are not as many joint positions as angles", where="joints", came=len(joints), allowed=str(len(angle))
        )
    for name, values in (("angle", angle), ("joints", joints), ("height", height)):
        if not np.isfinite(values).all():
            row = int(np.argwhere(~np.isfinite(values))[0, 0])
            raise InputError("a number is missing", where=f"{name}, row {row}", came=values[row], cure="Leave it out.")
    for name, values, most, allowed in (
        ("angle", angle, _TURNS, "two turns either way, in rad"),
        ("height", height, _TRAVEL, f"{1e3 * _TRAVEL:g} mm either way, in m"),
    ):
        if np.abs(values).max() > most:
            row = int(np.abs(values).argmax())
            raise InputError(
                "the number is too large",
                where=f"{name}, row {row}",
                came=float(values[row]),
                allowed=allowed,
                cure="Convert it to SI units.",
            )
    radius = _between(scan.profile, angle)
    if np.isnan(radius).all():
        raise InputError(
            "the line is missing at every angle", where=scan.source, cure="Check where the page's x axis was."
        )
    return DrawnCircle(source=scan.source, joints=joints, angle=angle, radius=radius, height=height)


def _between(profile: Array, angle: Array) -> Array:
    """Return the profile at angles [rad], linear between its sectors, NaN beside a missing one."""
    sectors = len(profile)
    place = angle * (sectors / (2 * math.pi))
    below = np.floor(place + 1e-9)
    share = np.maximum(place - below, 0.0)
    low, high = (profile[(below + more).astype(int) % sectors] for more in (0, 1))
    on_one = share < 1e-6
    return np.asarray(np.where(on_one, low, (1 - share) * low + share * np.where(on_one, 0.0, high)))
