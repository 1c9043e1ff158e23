"""The hexapod ballbar device: its designs, its kinematics in closed form, and the poses it can measure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.engine.robot.transform import cross, dot, rigid_motion, rotation_vector

# Cups and legs of the hexapod: which distances it has, and between which cups its six legs go (Nubiola, 3.2).
#
# The base fixture and the tool fixture carry three cups each, B1 to B3 and T1 to T3. A design says which of them are
# joined by the six legs: one base cup has two legs, the next three, the last one, so that one tool cup after the other
# can be found.

#: Three cups of a fixture in some order, counted from 0.
Order = tuple[int, int, int]
#: Ends of the three distances of a fixture, in the order in which they are given everywhere: 12, 23, 31.
SIDES: Final = ((0, 1), (1, 2), (2, 0))
#: How thin a triangle may be: its height over its longest side.
_THINNEST: Final = 1e-4


@dataclass(frozen=True)
class Device:
    """Lengths of the device as it is built, and its ballbar; the defaults are Nubiola's with a Renishaw QC20-W."""

    #: base, tool, leg: nominal distance between two cups of the base, of the tool, and between base and tool [m].
    base: float = 0.300
    tool: float = 0.150
    leg: float = 0.300
    reach: float = 1e-3  #: How far a length may be from its nominal one to be measured [m].
    sigma: float = 1e-6 / 1.96  #: Standard deviation of a measured length [m]: 1 um in 95 of 100 readings.

    def check(self, nominal: float, length: float, between: str, where: str | None = "ballbar") -> None:
        """Refuse a length that the ballbar cannot have read.

        Args:
            nominal, length: [m].
            between: The two cups, as ``B1-T2``.
            where: For the message; None where a job's parameter says enough.
        """
        if not abs(length - nominal) <= self.reach * (1 + 1e-9):
            raise InputError(
                f"the length {between} is beyond the range of the ballbar",
                where=where,
                came=f"{length * 1e3:.4f} mm",
                allowed=f"{nominal * 1e3:g} mm +/- {self.reach * 1e3:g} mm",
                cure="Check that the bar was between these two cups. Leave out a pose that cannot be measured.",
            )


DEVICE: Final = Device()


@dataclass(frozen=True)
class Design:
    """Which cups the six legs join."""

    base: Order  #: The base cups with two legs, with three, and with one.
    tool: Order  #: The tool cups found first (three legs), second (two legs) and third (one leg).

    @property
    def legs(self) -> tuple[tuple[int, int], ...]:
        """Base cup and tool cup of each leg: three to the first tool cup, two to the second, one to the third."""
        (i, j, k), (first, second, third) = self.base, self.tool
        return (i, first), (j, first), (k, first), (i, second), (j, second), (j, third)

    @property
    def leg_names(self) -> tuple[str, ...]:
        """The legs as ``B1-T2``."""
        return tuple(f"B{base + 1}-T{tool + 1}" for base, tool in self.legs)

    @property
    def name(self) -> str:
        """The design as the document writes it, ``112212331``: base 1 to tool 1 2, base 2 to 1 2 3, base 3 to 1."""
        (i, j, k), (first, second, third) = ([n + 1 for n in order] for order in (self.base, self.tool))
        return f"{i}{first}{second}{j}{first}{second}{third}{k}{first}"


def designs() -> tuple[Design, ...]:
    """Return all designs: every order of the base cups with every order of the tool cups."""
    orders = tuple(permutations((0, 1, 2)))
    return tuple(Design(base, tool) for base in orders for tool in orders)  # type: ignore[arg-type]


def handedness(order: Order) -> int:
    """Return 1 for an order that goes round as 1 2 3 does, -1 for one that goes the other way."""
    return 1 if order in ((0, 1, 2), (1, 2, 0), (2, 0, 1)) else -1


def side_names(fixture: str) -> tuple[str, str, str]:
    """Return the names of the three distances of fixture ``B`` or ``T``, as ``B1-B2``."""
    a, b, c = (f"{fixture}{i + 1}-{fixture}{j + 1}" for i, j in SIDES)
    return a, b, c


def triangle(sides: Sequence[float] | Array, fixture: str) -> Array:
    """Return the cups of a fixture in its own frame from its distances 12, 23 and 31.

    The first cup is the origin, the second lies on x, the third at positive y (Nubiola, 4.6 and 4.7).

    Args:
        sides: [m], ``(3,)`` or ``(3, n)``.
        fixture: ``B`` or ``T``, for messages.

    Returns:
        cups: ``(cup, 3)`` or ``(cup, 3, n)``.

    Raises:
        InputError: If the distances are not those of a triangle, or the three cups lie on one line.
    """
    d12, d23, d31 = (np.asarray(side, float) for side in sides)
    lengths = np.array(np.broadcast_arrays(d12, d23, d31)).reshape(3, -1)
    with np.errstate(divide="ignore", invalid="ignore"):  # two cups in one place
        x = (lengths[0] ** 2 + lengths[2] ** 2 - lengths[1] ** 2) / (2 * lengths[0])
    height = lengths[2] ** 2 - x**2
    flat = np.flatnonzero(~(height > (_THINNEST * lengths.max(axis=0)) ** 2))
    if len(flat):
        names, worst = side_names(fixture), lengths[:, flat[0]]
        longest = names[int(np.argmax(worst))]
        raise InputError(
            f"the cups {', '.join(f'{fixture}{n + 1}' for n in range(3))} lie on one line, or no triangle has these "
            "distances",
            where=longest,
            came=", ".join(f"{name} {length * 1e3:.3f} mm" for name, length in zip(names, worst, strict=True)),
            allowed="three distances of a triangle, each well below the sum of the others",
            cure=f"Measure {longest} again.",
        )
    zero = np.zeros_like(x)
    cups = np.array([[zero, zero, zero], [lengths[0], zero, zero], [x, np.sqrt(height), zero]])
    shape = np.broadcast_shapes(d12.shape, d23.shape, d31.shape)
    return cups.reshape(3, 3, *shape)


#: On which side of their three feet the second and the third tool cup lie, for the document's solutions 1 to 4.
SOLUTIONS: Final = {1: (1, 1), 2: (1, -1), 3: (-1, 1), 4: (-1, -1)}


def tripod(feet: Iterable[Array], legs: Iterable[Array], side: int, names: Sequence[str]) -> Array:
    """Return the point at given distances from three others (Nubiola, 3.4 to 3.11; `Tri`).

    Args:
        feet: Three points, each ``(3, ...)`` [m].
        legs: Distance of the point from each [m], ``(...)``.
        side: 1 if, seen from the point, the feet go round against the clock, -1 for the other point.
        names: Of the three legs, for messages.

    Raises:
        InputError: If the feet lie on one line, or the legs do not meet; with their names.
    """
    v1, v2, v3 = feet
    l1, l2, l3 = legs
    u, w = v2 - v1, v3 - v1
    n = cross(u, w)
    square = dot(n, n)
    if not (square > 1e-8 * dot(u, u) * dot(w, w)).all():
        raise InputError(
            "the three feet of these legs lie on one line, and the point where they meet is not determined",
            where=", ".join(names),
            cure="Check the measured distances between the cups.",
        )
    # The document measures from the frame's origin; from the first foot there is less to cancel.
    xi1 = (l1 * l1 - l2 * l2 + dot(u, u)) / 2
    xi2 = (l1 * l1 - l3 * l3 + dot(w, w)) / 2
    p = (xi1 * cross(w, n) + xi2 * cross(n, u)) / square
    height = l1 * l1 - dot(p, p)
    apart = np.flatnonzero(~(np.atleast_1d(height) >= 0))
    if len(apart):
        lengths = [float(np.broadcast_to(leg, np.shape(height)).flat[apart[0]]) for leg in (l1, l2, l3)]
        raise InputError(
            "legs of these lengths do not meet",
            where=", ".join(names),
            came=", ".join(f"{name} {length * 1e3:.3f} mm" for name, length in zip(names, lengths, strict=True)),
            cure="Measure them again; check that the bar was between the cups that are named.",
        )
    return np.asarray(v1 + p + side * np.sqrt(height / square) * n)


def tool_cups(
    design: Design, solution: int, base: Sequence[float] | Array, tool: Sequence[float] | Array, legs: Array
) -> Array:
    """Return where the tool cups are in the frame of the base fixture (Nubiola, 3.12 to 3.14).

    Args:
        design: Between which cups the legs were measured.
        solution: Which of the four ways to assemble the design, 1 to 4; those below the base are left out.
        base, tool: Distances 12, 23 and 31 of the fixtures [m], ``(3,)`` or ``(3, n)``.
        legs: Lengths in the order of :attr:`~truearm.engine.data.hexapod.Design.legs` [m], ``(6,)`` or ``(6,
            n)``.

    Returns:
        cups: T1, T2, T3: ``(3, 3)`` or ``(3, 3, n)``, cup first. The frame's origin is B1, x goes to B2, and z is the
            normal on whose side the tool is.

    Raises:
        InputError: If cups lie on one line, or legs do not meet; with the names of the lengths.
    """
    feet = triangle(base, "B")
    sides = dict(zip((frozenset(ends) for ends in SIDES), np.asarray(tool, float), strict=True))
    (i, j, k), (first, second, third) = design.base, design.tool
    hand = handedness(design.base)
    second_side, third_side = SOLUTIONS[solution]
    names = design.leg_names

    def between(a: int, b: int) -> tuple[Array, str]:
        return sides[frozenset((a, b))], f"T{min(a, b) + 1}-T{max(a, b) + 1}"

    t12, name12 = between(first, second)
    t23, name23 = between(second, third)
    t31, name31 = between(third, first)
    t1 = tripod((feet[i], feet[j], feet[k]), legs[:3], hand, names[:3])
    t2 = tripod((feet[i], feet[j], t1), (legs[3], legs[4], t12), hand * second_side, (*names[3:5], name12))
    t3 = tripod((t2, feet[j], t1), (t23, legs[5], t31), hand * third_side, (name23, names[5], name31))
    places = {first: t1, second: t2, third: t3}
    return np.array([places[cup] for cup in range(3)])


def leg_lengths(design: Design, base_cups: Array, tool_cups: Array) -> Array:
    """Return the length of each leg [m], ``(6,)`` or ``(6, n)``; the cups as :func:`tool_cups` returns them."""
    return np.array([np.linalg.norm(tool_cups[tool] - base_cups[base], axis=0) for base, tool in design.legs])


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


# A design can be assembled in four ways above the base. Half of these 144 assemblies put the flange between the tool's
# cups and the base, where arm and bar would meet; the other half are the 72 poses. They are numbered as in Nubiola's
# Figure 3.6, as far as the pairs printed in section 3.2 tell.
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
    hexapod_poses: list[HexapodPose] = []
    for design, solution in assemblies():
        places = tool_cups(design, solution, [device.base] * 3, [device.tool] * 3, np.full(6, device.leg))
        R, p = rigid_motion(cups, places)
        normal = np.cross(places[1] - places[0], places[2] - places[0])
        if (normal @ (p - places[0])) * (normal @ (middle - places[0])) < 0:
            hexapod_poses.append(HexapodPose(len(hexapod_poses) + 1, design, solution, places, R, p))
    return tuple(hexapod_poses)


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
    hexapod_poses: Sequence[HexapodPose], angle: float = NEAR_ANGLE, apart: float = NEAR_DISTANCE
) -> tuple[tuple[int, int], ...]:
    """Return the numbers of poses that are nearer to each other than both `angle` [rad] and `apart` [m].

    The limits matter: with Nubiola's fixture the groups lie at 8.35 deg with 11.1, 27.0 and 35.7 mm, and the next at
    30.1 deg with 39.8 mm.
    """
    R = np.array([pose.rotation for pose in hexapod_poses])
    p = np.array([pose.position for pose in hexapod_poses])
    i, j = np.triu_indices(len(hexapod_poses), 1)
    turned = np.linalg.norm(rotation_vector(np.swapaxes(R[i], 1, 2) @ R[j]), axis=1)
    near = (turned < angle) & (np.linalg.norm(p[i] - p[j], axis=1) < apart)
    pairs = zip(i[near].tolist(), j[near].tolist(), strict=True)
    return tuple((hexapod_poses[a].number, hexapod_poses[b].number) for a, b in pairs)


def distinct(
    hexapod_poses: Sequence[HexapodPose], angle: float = NEAR_ANGLE, apart: float = NEAR_DISTANCE
) -> tuple[HexapodPose, ...]:
    """Return the poses without the first of every near-equal pair that is still whole, in the order of their numbers.

    Of Nubiola's pairs that leaves out what Figure 3.6 crosses out.
    """
    dropped: set[int] = set()
    for first, second in near_equal(hexapod_poses, angle, apart):
        if second not in dropped:
            dropped.add(first)
    return tuple(pose for pose in hexapod_poses if pose.number not in dropped)
