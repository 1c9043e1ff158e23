"""A drawn line followed around a centre: its radius in every sector, at the middle of the ink across its width.

A sector is the mean of rays that lie a dot apart. The ink's middle is a centroid across the line. Its weight grows from
a third of the line's usual darkness and stays the same above half of it: a faint grid and uneven paper do not count,
nor does the pencil's grain within the line, and the weight vanishes where the line ends, so that the dots' spacing does
not show. A sector in which the line is absent, covered, crossed or far from its neighbours is
missing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.measurement.circles import fit_circle
from truearm.measurement.drawn_circle.candidates import Candidate
from truearm.measurement.drawn_circle.ink import Ink
from truearm.modeling.chain import Array

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
    return Line(
        centre=centre,
        radius=radius,
        profile=profile,
        beside=float(beside.mean()),
    )


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
    found = (darkest > np.maximum(threshold, _LEVELS[0] * usual[:, 0])) & (left >= 0) & (right < len(radii))
    if found.sum() < _LEAST_SECTORS * sectors:
        return nothing
    profile = np.where(found, weights @ radii / np.where(found, weights.sum(axis=1), 1.0), np.nan)
    step = radii[1] - radii[0]
    widths = (right - left - 1) * step
    width = float(np.median(widths[found]))
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
