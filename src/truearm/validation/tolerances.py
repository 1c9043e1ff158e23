"""Tolerances of a joint's assembly from its errors, errors from tolerances, and what they do at the flange.

Source: KR5 paper, sections 2.3 and 4.3. A hole of depth l whose far end may lie delta aside of its place lets the axis
lean by ``atan(delta / l)`` (equation 8): perpendicularity if the axis is square to its datum, parallelism if it goes
along it. Towards mu, from x to y, it leans by ``egamma = -atan(delta sin(mu) / l)`` and ``ebeta = atan(delta cos(mu)
cos(egamma) / l)`` (9 and 10, which print them for ``Ry Rx`` and without the sign; equation 5 has ``Rx Ry``).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot


@dataclass(frozen=True)
class Tolerance:
    """What one joint's assembly uses of its tolerances."""

    delta: float  #: How far the axis is aside at the hole's depth: perpendicularity or parallelism [m].
    towards: float  #: To which side it leans, from x towards y of the joint's frame [rad].
    position: tuple[float, float, float]  #: Of the joint's frame beside its place, x, y and z [m].


def tolerance_of(
    ebeta: float, egamma: float, depth: float, position: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> Tolerance:
    """Return the tolerance that errors use: angles [rad], hole depth and position [m]."""
    right, up = math.tan(ebeta) / math.cos(egamma), -math.tan(egamma)
    return Tolerance(checked_depth(depth) * math.hypot(right, up), math.atan2(up, right), position)


def errors_of_tolerance(delta: float, towards: float, depth: float) -> tuple[float, float]:
    """Return ebeta and egamma [rad] of an axis that is `delta` aside at a hole's depth [m], towards an angle [rad]."""
    share = delta / checked_depth(depth)
    egamma = -math.atan(share * math.sin(towards))
    return math.atan(share * math.cos(towards) * math.cos(egamma)), egamma


def checked_depth(depth: float) -> float:
    """Return a hole's depth [m], or refuse one that is none."""
    if not depth > 0.0:
        raise InputError("a hole needs a depth", parameter="depth", came=f"{depth * 1e3:g} mm", allowed="above 0 mm")
    return depth


def joint_tolerances(robot: Robot, depths: Sequence[float]) -> tuple[Tolerance, ...]:
    """Return what the joints of a robot with joint errors use of their tolerances; hole depths in m."""
    values = robot.values
    return tuple(
        tolerance_of(
            values[f"ebeta_{i}"],
            values[f"egamma_{i}"],
            depth,
            (values[f"ex_{i}"], values[f"ey_{i}"], values[f"ez_{i}"]),
        )
        for i, depth in enumerate(depths, 1)
    )


@dataclass(frozen=True, eq=False)
class FlangeError:
    """What the tolerances of the joints may do at the flange, over many configurations."""

    leaning: Array  #: Largest position error that each joint's leaning alone may cause [m], ``(joints,)``.
    #: The same of each joint's position tolerance, which moves all that is beyond alike [m], ``(joints,)``.
    position: Array
    #: If all of them come together at the worst, and in the mean of squares: at the worst configuration [m].
    together: tuple[float, float]


def flange_error(robot: Robot, leans: Sequence[float], positions: Sequence[float], q: Array) -> FlangeError:
    """Return the largest error of the flange's position that tolerances allow, each to its worst side.

    Args:
        robot: With joint errors, at those values around which they vary.
        leans: Largest angle of each joint's axis [rad].
        positions: Radius of the sphere in which each joint's frame may lie [m].
        q: Configurations to look at ``(n, joints)`` [rad].
    """
    count = len(robot.joints)
    names = [f"{angle}_{i}" for i in range(1, count + 1) for angle in ("ebeta", "egamma")]
    kinematics = robot.forward_kinematics(q)
    moved = robot.position_jacobian(kinematics, q, names).reshape(count, 2, 3, len(q))  # [m per rad]
    worst = np.linalg.norm(moved.transpose(0, 3, 2, 1), ord=2, axis=(2, 3))  # over all sides: (joints, n)
    leaning = worst * np.array(leans)[:, None]
    shifts = np.array(positions)
    return FlangeError(
        leaning.max(axis=1),
        shifts,
        (
            float((leaning.sum(axis=0) + shifts.sum()).max()),
            float(np.sqrt((leaning**2).sum(axis=0) + (shifts**2).sum()).max()),
        ),
    )
