"""Where the base fixture of the hexapod device stands, and how well the tool's cups are known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.data.hexapod import DEVICE, SIDES, SOLUTIONS, Design, Device, tool_cups, triangle
from truearm.engine.robot.chain import Array
from truearm.engine.robot.transform import Transform


# The robot brings one cup of its tool to each cup of the base. What it read there, and its current model, say where the
# three points are; the ballbar says how far apart they are, and much better. The triangle of those distances is laid
# onto the three points so that the sum of squares is least (Nubiola, 4.3 to 4.12). Its plane is that of the points, so
# this is a fit in two dimensions with a closed form; the document iterates.
@dataclass(frozen=True, eq=False)
class WorldFrame:
    """The frame of the base fixture: origin B1, x to B2, z the normal on whose side B3 is at positive y."""

    frame: Transform  #: Of the fixture in the frame of the points.
    plain: Transform  #: The same without the distances: origin in the first point, x through the second.
    seen: Array  #: Distances 12, 23 and 31 between the points [m], ``(3,)``.
    residual: Array  #: How far each point is from its place in the triangle [m], ``(3, 3)``.


def plain_frame(points: Array) -> Transform:
    """Return the frame of three points ``(3, 3)``: origin in the first, x through the second, the third at +y."""
    x = (points[1] - points[0]) / np.linalg.norm(points[1] - points[0])
    z = np.cross(x, points[2] - points[0])
    z /= np.linalg.norm(z)
    return Transform.from_matrix(np.column_stack([x, np.cross(z, x), z]), points[0])


def world_frame(points: Array, sides: Sequence[float] | Array) -> WorldFrame:
    """Return the frame of the base fixture.

    Args:
        points: B1, B2 and B3 by the robot's model [m], ``(3, 3)``.
        sides: Measured distances 12, 23 and 31 [m], ``(3,)``.

    Raises:
        InputError: If the points lie on one line, or the distances are of no triangle.
    """
    points = np.asarray(points, float)
    seen = np.array([np.linalg.norm(points[a] - points[b]) for a, b in SIDES])
    p = triangle(seen, "B")[:, :2]
    q = triangle(sides, "B")[:, :2]
    plain = plain_frame(points)
    R = plain.rotation
    from_middle, to_middle = q - q.mean(axis=0), p - p.mean(axis=0)
    turned = (from_middle[:, 0] * to_middle[:, 1] - from_middle[:, 1] * to_middle[:, 0]).sum()
    angle = np.arctan2(turned, (from_middle * to_middle).sum())
    c, s = np.cos(angle), np.sin(angle)
    in_plane = np.array([[c, -s], [s, c]])
    shift = p.mean(axis=0) - in_plane @ q.mean(axis=0)
    R_frame = R @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    origin = points[0] + R[:, :2] @ shift
    places = origin + np.pad(q, ((0, 0), (0, 1))) @ R_frame.T
    return WorldFrame(frame=Transform.from_matrix(R_frame, origin), plain=plain, seen=seen, residual=points - places)


#: The design of Table 3.1. The document takes its 35 permutations to be the same; the frame, which begins at B1 and B2,
#: makes a difference: over all of them the worst cup has 2.83 to 3.52.
DESIGN: Final = Design((0, 1, 2), (0, 1, 2))
#: Coordinates of the base cups that are not zero by the choice of the frame: x of B2, x and y of B3.
_FREE_OF_BASE: Final = ((1, 0), (2, 0), (2, 1))


#: Nodes of the quadrature over each angle of a direction: thirty leave 1e-9 of a radius.
_NODES: Final = 30


# How well the tool's cups are known, in standard deviations of one measured length (Nubiola, 3.4, Table 3.1).
#
# Twelve distances and twelve coordinates: three of the base, whose frame the cups themselves make, and nine of the
# tool. The lengths' derivatives by the coordinates are unit vectors along the bars, and their inverse gives every
# sensitivity at once, with all correlations.
@dataclass(frozen=True, eq=False)
class CupUncertainty:
    """Uncertainty of the tool's cups in one solution, in standard deviations of a length."""

    covariance: Array  #: Of T1, T2, T3 in the base's frame, ``(9, 9)``.
    #: Per axis of T3 as Table 3.1 has it: as if T1 and T2, and their coordinates, did not depend on each other, and B2
    #: were exact, ``(3,)``.
    third_as_printed: Array

    @property
    def norms(self) -> tuple[float, float, float]:
        """Root of the summed variances of T1, T2 and T3."""
        t1, t2, t3 = np.sqrt(np.diag(self.covariance).reshape(3, 3).sum(axis=1)).tolist()
        return t1, t2, t3

    @property
    def radii(self) -> tuple[float, float, float]:
        """Radius about each of T1, T2 and T3 that holds it in 95 of 100 cases."""
        t1, t2, t3 = (radius_95(self.covariance[i : i + 3, i : i + 3]) for i in (0, 3, 6))
        return t1, t2, t3


# Along a direction w of the whitened space, which is uniform on the sphere, a point is within r if chi of three degrees
# of freedom is below r / |L w|, with L L^T the covariance. Squares of w and eigenvalues are enough, and one octant.
def radius_95(covariance: Array) -> float:
    """Return the radius that holds a normal point in space in 95 of 100 cases, of its covariance ``(3, 3)``."""
    from scipy.optimize import brentq
    from scipy.special import gammainc

    sizes = np.linalg.eigvalsh(covariance)
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    up, turn = np.meshgrid(0.5 + 0.5 * nodes, 0.25 * np.pi * (1.0 + nodes))
    across = 1.0 - up**2
    squares = sizes[0] * across * np.cos(turn) ** 2 + sizes[1] * across * np.sin(turn) ** 2 + sizes[2] * up**2
    shares = 0.25 * np.outer(weights, weights)
    largest = 3.0 * float(np.sqrt(sizes.max()))
    return float(brentq(lambda r: (shares * gammainc(1.5, r**2 / (2.0 * squares))).sum() - 0.95, 0.0, largest))


def cup_uncertainty(
    solution: int, design: Design = DESIGN, device: Device = DEVICE, lengths: Array | None = None
) -> CupUncertainty:
    """Propagate the uncertainty of the twelve lengths (Nubiola, 3.15).

    Args:
        solution: 1 to 4.
        design: Which legs there are.
        device: Its nominal lengths.
        lengths: Base 12, 23, 31, tool 12, 23, 31, and the legs in the design's order [m], ``(12,)``; nominal if None.
    """
    d = _nominal(device) if lengths is None else lengths
    base, cups = triangle(d[:3], "B"), tool_cups(design, solution, d[:3], d[3:6], d[6:])
    rows = []
    for a, b in SIDES:
        rows.append(_row(base, cups, [("B", a, 1.0), ("B", b, -1.0)], base[a] - base[b]))
    for a, b in SIDES:
        rows.append(_row(base, cups, [("T", a, 1.0), ("T", b, -1.0)], cups[a] - cups[b]))
    for b, t in design.legs:
        rows.append(_row(base, cups, [("T", t, 1.0), ("B", b, -1.0)], cups[t] - base[b]))
    sensitivity = np.linalg.inv(np.array(rows))[3:]
    covariance = sensitivity @ sensitivity.T
    return CupUncertainty(covariance, _third_as_printed(design, base, cups, covariance))


def _nominal(device: Device) -> Array:
    return np.repeat([device.base, device.tool, device.leg], (3, 3, 6))


def _row(base: Array, cups: Array, ends: list[tuple[str, int, float]], way: Array) -> Array:
    """Return how the distance between two cups moves with the twelve coordinates."""
    unit = way / np.linalg.norm(way)
    row = np.zeros(12)
    for fixture, cup, sign in ends:
        if fixture == "T":
            row[3 + 3 * cup : 6 + 3 * cup] = sign * unit
        else:
            for place, (free, axis) in enumerate(_FREE_OF_BASE):
                row[place] += sign * unit[axis] * (free == cup)
    return row


def _third_as_printed(design: Design, base: Array, cups: Array, covariance: Array) -> Array:
    first, second, third = design.tool
    feet = [cups[second], base[design.base[1]], cups[first]]
    per_axis = np.diag(covariance).reshape(3, 3)
    moved = [per_axis[second], np.zeros(3), per_axis[first]]
    units = np.array([(cups[third] - foot) / np.linalg.norm(cups[third] - foot) for foot in feet])
    by_length = np.linalg.inv(units)
    variance = (by_length**2).sum(axis=1)
    for n, of_axis in enumerate(moved):
        variance = variance + np.outer(by_length[:, n], units[n]) ** 2 @ of_axis
    return np.asarray(np.sqrt(variance))


def cup_monte_carlo(
    solution: int, trials: int, rng: np.random.Generator, design: Design = DESIGN, device: Device = DEVICE
) -> tuple[float, float, float]:
    """Return the uncertainty of T1, T2 and T3 found by measuring anew many times, as :attr:`CupUncertainty.norms`.

    Args:
        solution: 1 to 4.
        trials: How often all twelve lengths are drawn.
        rng: For the noise.
        design, device: Which legs there are; nominal lengths and the ballbar's noise.
    """
    if trials < 2:
        raise InputError("a spread needs two trials or more", where="trials", came=trials)
    d = _nominal(device)[:, None] + device.sigma * rng.standard_normal((12, trials))
    cups = tool_cups(design, solution, d[:3], d[3:6], d[6:])
    t1, t2, t3 = np.sqrt(cups.var(axis=2, ddof=1).sum(axis=1)) / device.sigma
    return float(t1), float(t2), float(t3)


def all_solutions(device: Device = DEVICE) -> dict[int, CupUncertainty]:
    """Return the uncertainty of each of the document's solutions, by its number."""
    return {solution: cup_uncertainty(solution, device=device) for solution in SOLUTIONS}
