"""Circles through measured points in space: the plane by singular values, the circle in it by least squares.

The plane through the centroid leaves the smallest sum of squared axial distances; its normal is the right singular
vector of the smallest singular value (KR5 paper, equations 12 to 15). In the plane the circle that is linear in its
unknowns (equations 17 to 19, with ``b = +(x^2 + y^2)`` the centre is ``+c/2``) is the start of the one that leaves the
smallest sum of squared radial distances: the linear one is too small where the arc is short. The plane's own axes are
the new coordinates, so nothing has to be turned (equation 16 is 0/0 for a circle that lies level already).

To first order tilting the plane moves no point radially, so plane and circle stand alone, each with its own covariance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array

#: Three numbers of the plane and three of the circle; one point more leaves something over to judge them by.
FEWEST: Final = 4
#: An axis or a radius less certain than this is none: standard deviation of the tilt [rad], and share of the radius.
_LARGEST_TILT: Final = 0.05
_LARGEST_SHARE: Final = 0.1
#: Share of its length that an arc must be wide to be no straight line.
_STRAIGHT_LINE: Final = 1e-9
#: Points nearer together than this are one [m].
_SAME_POINT: Final = 1e-9


@dataclass(frozen=True, eq=False)
class Circle:
    """A circle through measured points."""

    centre: Array  #: [m], ``(3,)``.
    x: Array  #: x, y, normal: axes of the circle's own frame, unit vectors ``(3,)``; the normal is the axis.
    y: Array
    normal: Array
    radius: float  #: [m].
    radial: Array  #: radial, axial: distance of each point from the circle outwards and along the normal [m], ``(n,)``.
    axial: Array
    angle: Array  #: Of each point about the normal, from `x` towards `y` [rad], ``(n,)``, -pi to pi.
    sigma: float  #: Standard deviation of a coordinate of the points [m], declared or from `radial` and `axial`.
    shares: Array  #: Covariance of centre along x and y and of the radius ``(3, 3)``, if that deviation were 1.
    #: Variance of the normal's tilt towards x and towards y ``(2,)``, which have no covariance, if that deviation were
    #: 1.
    tilts: Array

    @property
    def residual(self) -> float:
        """Deviation of a coordinate that the distances from the circle show [m]."""
        return math.sqrt(float(self.radial @ self.radial + self.axial @ self.axial) / self.freedom)

    @property
    def freedom(self) -> int:
        """Degrees of freedom of :attr:`residual`."""
        return 2 * len(self.radial) - 6

    @property
    def centre_deviation(self) -> float:
        """Standard deviation of the centre in the plane, in the direction where it is largest [m]."""
        return self.sigma * math.sqrt(float(np.linalg.eigvalsh(self.shares[:2, :2])[-1]))

    @property
    def tilt_deviation(self) -> float:
        """Standard deviation of the axis' direction, towards the side where it is largest [rad]."""
        return self.sigma * math.sqrt(float(self.tilts.max()))

    @property
    def radius_deviation(self) -> float:
        """Standard deviation of the radius [m]."""
        return self.sigma * math.sqrt(float(self.shares[2, 2]))

    @property
    def arc(self) -> float:
        """How far round the points reach: a turn less the largest gap between them [rad]."""
        around = np.sort(self.angle)
        return float(2 * math.pi - np.diff(around, append=around[0] + 2 * math.pi).max())

    def with_sigma(self, sigma: float) -> Circle:
        """Return the circle with another standard deviation of a coordinate [m]."""
        return replace(self, sigma=sigma)

    def reversed(self) -> Circle:
        """Return the circle with its normal pointing the other way; x stays."""
        flip = np.diag([1.0, -1.0, 1.0])
        return replace(
            self, y=-self.y, normal=-self.normal, axial=-self.axial, angle=-self.angle, shares=flip @ self.shares @ flip
        )


def fit_circle(points: Array, sigma: float | None = None, where: str = "circle") -> Circle:
    """Fit a circle to points ``(n, 3)`` [m].

    Args:
        sigma: Declared standard deviation of a coordinate [m]; estimated from what the circle leaves if None.
        where: The points' origin, for messages.

    Raises:
        InputError: If there are fewer than four points, they lie on a line, or the arc is too short: the axis would be
            uncertain by more than 50 mrad or the radius by more than a tenth.
    """
    if len(points) < FEWEST:
        raise InputError(
            "too few points for a circle", where=where, came=len(points), allowed=f"{FEWEST} or more, well apart"
        )
    centroid = points.mean(axis=0)
    centred = points - centroid
    _, widths, (across, along, _) = np.linalg.svd(centred, full_matrices=False)
    if widths[1] <= max(_STRAIGHT_LINE * widths[0], _SAME_POINT):
        raise InputError(
            "the points lie on a straight line or in one place, so no circle fits them",
            where=where,
            cure="Turn the joint further, or put the reflector further from its axis.",
        )
    normal = np.cross(across, along)
    x, y = centred @ across, centred @ along
    centre, radius, J = _in_plane(np.stack([x, y]))
    distance = np.hypot(x - centre[0], y - centre[1])
    circle = Circle(
        centre=centroid + centre[0] * across + centre[1] * along,
        x=across,
        y=along,
        normal=normal,
        radius=radius,
        radial=distance - radius,
        axial=centred @ normal,
        angle=np.arctan2(y - centre[1], x - centre[0]),
        sigma=1.0,
        shares=np.asarray(np.linalg.inv(J.T @ J)),
        tilts=1.0 / widths[:2] ** 2,
    )
    circle = circle.with_sigma(circle.residual if sigma is None else sigma)
    if circle.tilt_deviation > _LARGEST_TILT or circle.radius_deviation > _LARGEST_SHARE * radius:
        raise InputError(
            "the arc is too short for a circle",
            where=where,
            came=f"{len(points)} points over {math.degrees(circle.arc):.3g} deg: radius {radius * 1e3:.4g} mm with a"
            f" standard deviation of {circle.radius_deviation * 1e3:.2g} mm, axis uncertain by"
            f" {circle.tilt_deviation * 1e3:.2g} mrad",
            allowed=f"a radius known to {_LARGEST_SHARE:.0%} and an axis known to {_LARGEST_TILT * 1e3:g} mrad",
            cure="Turn the joint further, or put the reflector further from its axis.",
        )
    return circle


def _in_plane(points: Array) -> tuple[Array, float, Array]:
    """Return centre ``(2,)``, radius and Jacobian ``(n, 3)`` of the circle through points of a plane ``(2, n)``."""
    x, y = points
    A = np.column_stack([x, y, np.ones_like(x)])
    c = np.linalg.lstsq(A, x**2 + y**2, rcond=None)[0]
    solution = np.array([c[0] / 2, c[1] / 2, math.sqrt(max(c[2] + (c[0] ** 2 + c[1] ** 2) / 4, 0.0))])
    for _ in range(50):
        away = points - solution[:2, None]
        distance = np.linalg.norm(away, axis=0)
        J = -np.column_stack([*(away / distance), np.ones_like(x)])
        step = np.linalg.lstsq(J, solution[2] - distance, rcond=None)[0]
        solution = solution + step
        if np.abs(step).max() <= 1e-14 * abs(solution[2]):
            break
    return solution[:2], float(solution[2]), J
