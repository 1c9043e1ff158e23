"""The poses the device can measure: every design, every way to assemble it, without those that hit the fixture.

A design can be assembled in four ways above the base. Half of these 144 assemblies put the flange between the tool's
cups and the base, where arm and bar would meet; the other half are the 72 poses. They are numbered as in Nubiola's
Figure 3.6, as far as the pairs printed in section 3.2 tell.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.measurement.hexapod.geometry import DEVICE, Design, Device, Order, triangle
from truearm.measurement.hexapod.kinematics import tool_cups
from truearm.modeling.chain import Array
from truearm.modeling.transform import rigid_motion, rotation_vector

#: Cups T1, T2, T3 of the triangular artefact in the flange frame [m] (Nubiola, 2.2.1), 150 mm apart exactly.
CUPS: Final = np.array(
    [[0.0, 0.0, 0.125], [0.075, np.sqrt(0.150**2 - 0.075**2 - 0.090**2), 0.215], [0.150, 0.0, 0.125]]
)
#: Poses nearer than this in angle [rad] and in the place of the flange [m] teach much the same (Nubiola, 3.2).
NEAR_ANGLE: Final = np.radians(30.0)
NEAR_DISTANCE: Final = 0.050

_SOLUTIONS: Final = (2, 1, 3, 4)
_LEADS: Final = (0, 2, 1)
#: The figure begins its first three poses with another turn of the tool: {1, 72}, {2, 70}, {3, 71}.
_FIRST_LEADS: Final = (1, 0, 2)


@dataclass(frozen=True, eq=False)
class HexapodPose:
    """One pose that the device can measure, at nominal lengths, in the frame of the base fixture."""

    number: int  #: From 1, as in Nubiola's Figure 3.6.
    design: Design  #: Which legs to measure.
    solution: int  #: Which way the design is assembled, 1 to 4.
    cups: Array  #: T1, T2, T3 [m], ``(3, 3)``.
    rotation: Array  #: rotation, position: of the flange [m], ``(3, 3)`` and ``(3,)``.
    position: Array


def assemblies() -> Iterator[tuple[Design, int]]:
    """Yield the 144 assemblies: design and solution, those of neighbouring numbers together."""
    for turn in range(3):
        for order in ((0, 1, 2), (2, 1, 0)):
            for solution in _SOLUTIONS:
                base = _turned(order, turn + (solution == 4))
                is_first = turn == 0 and order == (0, 1, 2) and solution == _SOLUTIONS[0]
                for lead in _FIRST_LEADS if is_first else _LEADS:
                    for step in (1, 2):
                        yield Design(base, (lead, (lead + step) % 3, (lead + 2 * step) % 3)), solution


def _turned(order: Sequence[int], turn: int) -> Order:
    first, second, third = ((cup + turn) % 3 for cup in order)
    return first, second, third


def poses(cups: Array = CUPS, device: Device = DEVICE) -> tuple[HexapodPose, ...]:
    """Return the poses that can be measured: the flange beyond the tool's plane, seen from the base.

    Parameters
    ----------
    cups
        T1, T2, T3 in the flange frame [m], ``(3, 3)``.
    device
        Nominal lengths.

    Raises
    ------
    InputError
        If the cups are not as far apart as the device's tool, or the flange lies in their plane.
    """
    cups = checked_cups(cups, device)
    base = triangle([device.base] * 3, "B")
    middle = base.mean(axis=0)
    found: list[HexapodPose] = []
    for design, solution in assemblies():
        places = tool_cups(design, solution, [device.base] * 3, [device.tool] * 3, np.full(6, device.leg))
        R, p = rigid_motion(cups, places)
        normal = np.cross(places[1] - places[0], places[2] - places[0])
        if (normal @ (p - places[0])) * (normal @ (middle - places[0])) < 0:
            found.append(HexapodPose(len(found) + 1, design, solution, places, R, p))
    return tuple(found)


def checked_cups(cups: Array, device: Device = DEVICE) -> Array:
    """Return the cups of a tool, or refuse them where the device cannot be built with them."""
    cups = np.asarray(cups, float)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        device.check(device.tool, float(np.linalg.norm(cups[a] - cups[b])), f"T{a + 1}-T{b + 1}", "tool")
    normal = np.cross(cups[1] - cups[0], cups[2] - cups[0])
    if abs(normal @ cups[0]) < 0.01 * device.tool * np.linalg.norm(normal):
        raise InputError(
            "the flange lies in the plane of the tool's cups, so neither side is free for the arm",
            where="tool",
            cure="Use a fixture whose cups stand before the flange.",
        )
    return cups


def distance(a: HexapodPose, b: HexapodPose) -> tuple[float, float]:
    """Return the angle [rad] and the distance of the flange [m] between two poses."""
    angle = np.linalg.norm(rotation_vector(a.rotation.T @ b.rotation))
    return float(angle), float(np.linalg.norm(a.position - b.position))


def near_equal(
    found: Sequence[HexapodPose], angle: float = NEAR_ANGLE, apart: float = NEAR_DISTANCE
) -> tuple[tuple[int, int], ...]:
    """Return the numbers of poses that are nearer to each other than both `angle` [rad] and `apart` [m].

    The limits matter: with Nubiola's fixture the groups lie at 8.35 deg with 11.1, 27.0 and 35.7 mm, and the next at
    30.1 deg with 39.8 mm.
    """
    R = np.array([pose.rotation for pose in found])
    p = np.array([pose.position for pose in found])
    i, j = np.triu_indices(len(found), 1)
    turned = np.linalg.norm(rotation_vector(np.swapaxes(R[i], 1, 2) @ R[j]), axis=1)
    near = (turned < angle) & (np.linalg.norm(p[i] - p[j], axis=1) < apart)
    pairs = zip(i[near].tolist(), j[near].tolist(), strict=True)
    return tuple((found[a].number, found[b].number) for a, b in pairs)


def distinct(
    found: Sequence[HexapodPose], angle: float = NEAR_ANGLE, apart: float = NEAR_DISTANCE
) -> tuple[HexapodPose, ...]:
    """Return the poses without the first of every near-equal pair that is still whole, in the order of their numbers.

    Of Nubiola's pairs that leaves out what Figure 3.6 crosses out.
    """
    dropped: set[int] = set()
    for first, second in near_equal(found, angle, apart):
        if second not in dropped:
            dropped.add(first)
    return tuple(pose for pose in found if pose.number not in dropped)
