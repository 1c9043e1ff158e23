"""An arm as capsules: lines from joint to joint, to the flange and to each target, with a thickness.

How thick the links of an arm are stands in no kinematic table. Arms of all makers are much alike, so it follows from
the length of the stretched arm: the first half of it is thicker than the second, in which the wrist is.

Links between parallel axes may lie beside these lines. Such a link is all of a plate: its line, moved along the axes
from where the links may lie on the one side to the other. Lines side by side stand for it, with the gap between them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, pairwise, product
from typing import Final

import numpy as np

from truearm.engine.base.errors import Notice, Rule
from truearm.engine.motion.constraints import at_the_origin
from truearm.engine.robot.chain import Array, ForwardKinematics
from truearm.engine.robot.robot import Robot

# Where links may lie beside the lines of the model, along joint axes that are parallel.
#
# Where along parallel axes a link lies does not change where it takes what follows, so a model may have the whole way
# along them at one joint, and its lines beside the links. Joint tables of Universal Robots have it at joint 4.

#: What lies less beside is within the thickness of a link [m].
_SMALL: Final = 0.01
#: Axes of a calibrated robot are parallel, too: factories miss by a tenth of this [rad].
_PARALLEL: Final = 0.01
#: Links are looked for up to so many times what the model and the centres of gravity have. The upper arms of UR3 to
#: UR30 lie at 0.92 to 1.35 times the way along the axes, the forearms at 0.05 to 0.30 (``offsets`` of the
#: physical_parameters.yaml in UniversalRobots/Universal_Robots_ROS2_Description).
BEYOND: Final = 1.4


@dataclass(frozen=True)
class Beside:
    """Joints whose axes are parallel, and where along them their links may lie.

    Places are along the axis of the first, from its origin, positive to the side to which more of them lie.
    """

    joints: tuple[int, ...]  #: From 1, one after the other.
    low: float  #: low, high: between which places the links are taken to lie [m]; zero is between them.
    high: float
    origins: tuple[float, ...]  #: Where the origin of each joint is [m].
    side: float  #: 1 if that side is along the axis of the first, -1 if it is against it.


def links_beside(robot: Robot) -> tuple[Beside, ...]:
    """Return the joints whose links may lie beside the lines of the model.

    No model says where along parallel axes links lie. They are taken to lie between the origins of the joints, what
    follows them and the centres of gravity of the links between, where the robot has masses, each :data:`BEYOND` times
    as far from the first origin.
    """
    arm, beside = at_the_origin(robot).rigid, []
    count = len(robot.joints)
    kinematics = arm.forward_kinematics(np.zeros((1, count)))
    moving = arm.moving[:count]
    axes = [kinematics.axis(i).reshape(3) for i in moving]
    points = [kinematics.origin(i).reshape(3) for i in moving] + [kinematics.position.reshape(3)]
    centres = _centres(arm)
    first = 0
    while first < count:
        last = first
        while last + 1 < count and _parallel(arm, axes, first, last + 1):
            last += 1
        if last > first:
            origins = [float(axes[first] @ (points[k] - points[first])) for k in range(first, last + 2)]
            known = [
                *origins,
                *(float(axes[first] @ (at - points[first])) for k in range(first, last) for at in centres[k]),
            ]
            low, high = BEYOND * min(known), BEYOND * max(known)
            if high - low >= _SMALL:
                side = 1.0 if high >= -low else -1.0
                low, high = sorted((side * low, side * high))
                numbers = tuple(range(first + 1, last + 2))
                beside.append(Beside(numbers, low, high, tuple(side * at for at in origins[:-1]), side))
        first = last + 1
    return tuple(beside)


def _parallel(arm: Robot, axes: list[Array], first: int, second: int) -> bool:
    turning = arm.joints[first].kind == arm.joints[second].kind == "revolute"
    return turning and bool(np.linalg.norm(np.cross(axes[first], axes[second])) < _PARALLEL)


def _centres(arm: Robot) -> list[list[Array]]:
    """Return the centres of gravity of the link behind each joint [m], at joint positions zero, each ``(3,)``."""
    ends = [0, *accumulate(len(link) for link in arm.moved_links)]
    rigid = arm.arm.forward_kinematics(np.zeros((len(arm.joints), 1)), arm.values)
    centres: list[list[Array]] = [[] for _ in arm.joints]
    for link in arm.masses:
        if link.mass > 0.0 and link.joint < len(arm.joints):
            end = ends[link.joint]
            centre = rigid.origin(end).reshape(3) + rigid.matrix(end).reshape(3, 3) @ np.array(link.cog)
            centres[link.joint - 1].append(centre)
    return centres


LINKS_BESIDE: Final = Rule(
    "links-beside",
    "note",
    "the arm has parallel axes, and its links may lie beside the lines of the model: between which places along the "
    "axis they are kept clear",
)


def beside_notices(robot: Robot) -> list[Notice]:
    """Return what to know of an arm whose links may lie beside the lines of the model."""
    notices = []
    for group in links_beside(robot):
        numbers = f"{', '.join(str(j) for j in group.joints[:-1])} and {group.joints[-1]}"
        low, high = sorted(round(1e3 * group.side * at) for at in (group.low, group.high))
        notices.append(
            LINKS_BESIDE(
                f"The axes of joints {numbers} are parallel, and no model says where along them the links are. The arm "
                f"keeps clear wherever they lie from {low} to {high} mm along the axis of joint {group.joints[0]} "
                "from where the model has it. If a drawing has a link farther out, state a `clearance` larger "
                "by that."
            )
        )
    return notices


#: Radius of links that begin in the first half of the stretched arm, and of the others, by its length.
RADII: Final = (0.06, 0.045)
#: Radius of what holds a target [m].
TARGET_RADIUS: Final = 0.025
#: What is shorter is no link of its own; what moves less stands still [m].
_SMALL_ARM_CAPSULES: Final = 1e-3
#: Of more targets those are looked at that are farthest out in some direction.
_MOST_TARGETS: Final = 12
#: Lines of a plate are no farther apart than this times its radius.
_GAP: Final = 1.5
_SAMPLE: Final = 300


@dataclass(frozen=True)
class Capsule:
    """A line between two points of the arm, or lines that stand for a plate, and its radius."""

    start: int  #: start, end: numbers of the points, see :meth:`ArmCapsules.points`.
    end: int
    radius: float  #: [m].
    tool: bool = False  #: Whether it holds a target.
    #: Numbers of the points at both ends of each line; one line from start to end, unless it is a plate.
    lines: tuple[tuple[int, int], ...] = ()
    #: How far a point of the plate is from the nearest of its lines along the parallel axes at most [m].
    gap: float = 0.0
    joints: tuple[int, ...] = ()  #: Those with parallel axes between which a plate lies.
    #: The points at both ends of its line at right angles to these axes, at one side; None if it has none. Two plates
    #: of the same axes are as far apart as these lines.
    across: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        if not self.lines:
            object.__setattr__(self, "lines", ((self.start, self.end),))

    @property
    def points(self) -> tuple[int, ...]:
        """All points at the ends of its lines."""
        return tuple(sorted({point for line in self.lines for point in line}))


@dataclass(frozen=True, eq=False)
class _Row:
    """Points side by side along a joint's axis, at which links may lie that a model has elsewhere."""

    joint: int  #: From 1.
    first: int  #: Number of the first of the points.
    places: Array  #: Where each is along the axis from the origin of the joint [m], evenly.
    group: Beside  #: The joints with parallel axes.


class ArmCapsules:
    """The capsules of a robot, without its joint effects, in its base frame.

    Points are numbered: 0 is the origin of the base, then come the origins of the joints, the flange and the targets.
    Behind these come the points side by side along axes that are parallel.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot = at_the_origin(robot).rigid
        self.joints = len(robot.joints)
        self.flange = self.joints + 1
        self.targets = tuple(target.name for target in robot.targets)
        if len(self.targets) > _MOST_TARGETS:
            self.targets = self._outermost()
            del self.__dict__["_places"]
        self.beside = links_beside(robot)
        self.modelled = self.flange + 1 + len(self.targets)

    def points(self, q: Array) -> Array:
        """Return the points at joint positions ``(n, joints)`` [m], ``(points, 3, n)``."""
        kinematics = self.robot.forward_kinematics(q)
        points = self._of_the_model(kinematics)
        for row in self._rows:
            # Along the first of the axes, which are parallel.
            axis = kinematics.axis(self.robot.moving[row.group.joints[0] - 1])
            points += [points[row.joint] + place * axis for place in row.places.tolist()]
        return np.array(points)

    def _of_the_model(self, kinematics: ForwardKinematics) -> list[Array]:
        shape = kinematics.position.shape
        points = [np.zeros(shape)]
        points += [np.broadcast_to(kinematics.origin(i), shape) for i in self.robot.moving[: self.joints]]
        points.append(kinematics.position)
        if self.targets:
            rotation = kinematics.matrix()
            points += [kinematics.position + (rotation @ place).T for place in self._places]
        return points

    @cached_property
    def sample(self) -> Array:
        """Configurations all over the robot's limits, both ends of all of them among them, ``(n, joints)``."""
        low, high = np.array([joint.range for joint in self.robot.joints]).T
        drawn = np.random.default_rng(0).uniform(low, high, (_SAMPLE, self.joints))
        return np.concatenate([[low, high], drawn])

    @cached_property
    def sampled(self) -> Array:
        """The points at :attr:`sample`."""
        return self.points(self.sample)

    @cached_property
    def _modelled(self) -> Array:
        """The points of the model at :attr:`sample`."""
        return np.array(self._of_the_model(self.robot.forward_kinematics(self.sample)))

    @cached_property
    def lengths(self) -> Array:
        """How far each point up to the flange is from the one before at most [m], ``(joints + 2,)``; 0 for the base."""
        steps = np.diff(self._modelled[: self.flange + 1], axis=0)
        return np.concatenate([[0.0], np.linalg.norm(steps, axis=1).max(axis=1)])

    @cached_property
    def along(self) -> Array:
        """How far each point is from the base along the arm at most [m], ``(points,)``.

        Points beside a joint are as far as the joint, see :attr:`aside`.
        """
        along = np.cumsum(self.lengths)
        tool = self._modelled[self.flange + 1 :] - self._modelled[self.flange]
        tools = along[-1] + np.linalg.norm(tool, axis=1).max(axis=1, initial=0.0)
        return np.concatenate([along, tools, *(np.full(len(row.places), along[row.joint]) for row in self._rows)])

    @cached_property
    def aside(self) -> Array:
        """How far each point is beside a joint, along its axis [m], ``(points,)``; zero for points of the model."""
        return np.concatenate([np.zeros(self.modelled), *(np.abs(row.places) for row in self._rows)])

    def joint_of(self, point: int) -> int:
        """Return the point of the model that a point lies beside; a point of the model itself."""
        return next((row.joint for row in self._rows if 0 <= point - row.first < len(row.places)), point)

    def parallel_at(self, point: int) -> int:
        """Return the first of the joints, from 1, along whose parallel axes a point lies; 0 for points of the model."""
        rows = (row for row in self._rows if 0 <= point - row.first < len(row.places))
        return next((row.group.joints[0] for row in rows), 0)

    @cached_property
    def fixed(self) -> tuple[int, ...]:
        """Points of the model that stand still whatever the joints do."""
        still = (np.ptp(self._modelled, axis=2) < _SMALL_ARM_CAPSULES).all(axis=1)
        return tuple(int(k) for k in np.flatnonzero(still))

    @cached_property
    def links(self) -> tuple[Capsule, ...]:
        """The links from the base to the flange; what is shorter than 1 mm is none."""
        return tuple(self._plate(start, end, radius) for start, end, radius in self._modelled_links())

    def _modelled_links(self) -> list[tuple[int, int, float]]:
        """Return the points at both ends of each link, and its radius [m]."""
        ends = [k for k in range(1, self.flange + 1) if self.lengths[k] >= _SMALL_ARM_CAPSULES]
        lines = [(self._last_at(start), end) for start, end in pairwise([0, *ends])]
        half = self.along[self.flange] / 2.0
        return [
            (start, end, RADII[0 if self.along[start] < half else 1] * float(self.along[self.flange]))
            for start, end in lines
        ]

    def _plate(self, start: int, end: int, radius: float) -> Capsule:
        """Return a link as a capsule; as a plate if it begins at a joint whose axis is parallel to another.

        The last of the links begins anywhere along the axis, and ends where the model has it. If it leads along the
        axis, two lines cover it: from either side to there.
        """
        rows = {row.joint: row for row in self._rows}
        if start not in rows:
            return Capsule(start, end, radius)
        row, other = rows[start], rows.get(end)
        numbers = range(len(row.places))
        gap = abs(float(row.places[1] - row.places[0])) / 2.0
        across = None
        if other is not None and other.group is row.group:
            lines = tuple((row.first + k, other.first + k) for k in numbers)
            across = lines[0]
        elif self._leads_along(row, end):
            lines, gap, across = ((row.first, end), (row.first + numbers[-1], end)), 0.0, (row.first, row.first)
        else:
            lines = tuple((row.first + k, end) for k in numbers)
        return Capsule(start, end, radius, False, lines, gap, row.group.joints, across)

    def _leads_along(self, row: _Row, end: int) -> bool:
        ways = self.sampled[[row.first, row.first + len(row.places) - 1, end]]
        axis = (ways[1] - ways[0]) / (row.places[-1] - row.places[0])
        way = ways[2] - ways[0]
        return bool(np.linalg.norm(way - (way * axis).sum(axis=0) * axis, axis=0).max() < _SMALL_ARM_CAPSULES)

    @cached_property
    def _rows(self) -> tuple[_Row, ...]:
        """Points beside each joint whose axis is parallel to another."""
        rows: list[_Row] = []
        first, way = self.modelled, np.cumsum(self.lengths)
        for group in self.beside:
            thin = RADII[0 if way[group.joints[-1]] < way[-1] / 2.0 else 1] * float(way[-1])
            count = 1 + max(1, int(np.ceil((group.high - group.low) / (_GAP * thin))))
            for joint, origin in zip(group.joints, group.origins, strict=True):
                places = group.side * (np.linspace(group.low, group.high, count) - origin)
                rows.append(_Row(joint, first, places, group))
                first += count
        return tuple(rows)

    @cached_property
    def tools(self) -> tuple[Capsule, ...]:
        """From the flange to each target that is not on it."""
        return tuple(
            Capsule(self.flange, self.flange + 1 + k, TARGET_RADIUS, tool=True)
            for k in range(len(self.targets))
            if self.along[self.flange + 1 + k] - self.along[self.flange] >= _SMALL_ARM_CAPSULES
        )

    def _last_at(self, point: int) -> int:
        """Return the last of the points that lie where this one lies."""
        while point < self.flange and self.lengths[point + 1] < _SMALL_ARM_CAPSULES:
            point += 1
        return point

    @cached_property
    def _places(self) -> list[Array]:
        """Where targets are on the flange [m]."""
        return [np.array(self.robot.tool_place(name).translation) for name in self.targets]

    def _outermost(self) -> tuple[str, ...]:
        places = np.array(self._places)
        ways = np.array([way for way in product((-1.0, 0.0, 1.0), repeat=3) if any(way)])
        return tuple(self.targets[k] for k in sorted({int(k) for k in np.argmax(places @ ways.T, axis=0)}))
