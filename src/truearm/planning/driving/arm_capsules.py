"""An arm as capsules: lines from joint to joint, to the flange and to each target, with a thickness.

How thick the links of an arm are stands in no kinematic table. Arms of all makers are much alike, so it follows from
the length of the stretched arm: the first half of it is thicker than the second, in which the wrist is.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Final

import numpy as np

from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot
from truearm.planning.constraints.constraints import at_the_origin

#: Radius of links that begin in the first half of the stretched arm, and of the others, by its length.
RADII: Final = (0.06, 0.045)
#: Radius of what holds a target [m].
TARGET_RADIUS: Final = 0.025
#: What is shorter is no link of its own; what moves less stands still [m].
_SMALL: Final = 1e-3
#: Of more targets those are looked at that are farthest out in some direction.
_MOST_TARGETS: Final = 12
_SAMPLE: Final = 300


@dataclass(frozen=True)
class Capsule:
    """A line between two points of the arm, and its radius.

    Attributes
    ----------
    start, end
        Numbers of the points, see :meth:`ArmCapsules.points`.
    radius
        [m].
    tool
        Whether it holds a target.
    """

    start: int
    end: int
    radius: float
    tool: bool = False


class ArmCapsules:
    """The capsules of a robot, without its joint effects, in its base frame.

    Points are numbered: 0 is the origin of the base, then come the origins of the joints, the flange and the targets.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot = at_the_origin(robot).rigid
        self.joints = len(robot.joints)
        self.flange = self.joints + 1
        self.targets = tuple(target.name for target in robot.targets)
        if len(self.targets) > _MOST_TARGETS:
            self.targets = self._outermost()
            del self.__dict__["_places"]

    def points(self, q: Array) -> Array:
        """Return the points at joint positions ``(n, joints)`` [m], ``(points, 3, n)``."""
        kinematics = self.robot.forward_kinematics(q)
        shape = kinematics.position.shape
        points = [np.zeros(shape)]
        points += [np.broadcast_to(kinematics.origin(i), shape) for i in self.robot.moving[: self.joints]]
        points.append(kinematics.position)
        if self.targets:
            rotation = kinematics.matrix()
            points += [kinematics.position + (rotation @ place).T for place in self._places]
        return np.array(points)

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
    def lengths(self) -> Array:
        """How far each point up to the flange is from the one before at most [m], ``(joints + 2,)``; 0 for the base."""
        steps = np.diff(self.sampled[: self.flange + 1], axis=0)
        return np.concatenate([[0.0], np.linalg.norm(steps, axis=1).max(axis=1)])

    @cached_property
    def along(self) -> Array:
        """How far each point is from the base along the arm at most [m], ``(points,)``."""
        along = np.cumsum(self.lengths)
        tool = self.sampled[self.flange + 1 :] - self.sampled[self.flange]
        return np.concatenate([along, along[-1] + np.linalg.norm(tool, axis=1).max(axis=1, initial=0.0)])

    @cached_property
    def fixed(self) -> tuple[int, ...]:
        """Points that stand still whatever the joints do."""
        return tuple(int(k) for k in np.flatnonzero((np.ptp(self.sampled, axis=2) < _SMALL).all(axis=1)))

    @cached_property
    def links(self) -> tuple[Capsule, ...]:
        """The links from the base to the flange; what is shorter than 1 mm is none."""
        ends = [k for k in range(1, self.flange + 1) if self.lengths[k] >= _SMALL]
        starts = [0, *ends[:-1]]
        half = self.along[self.flange] / 2.0
        found = []
        for start, end in zip(starts, ends, strict=True):
            thick = RADII[0] if self.along[start] < half else RADII[1]
            found.append(Capsule(end=end, start=self._last_at(start), radius=thick * float(self.along[self.flange])))
        return tuple(found)

    @cached_property
    def tools(self) -> tuple[Capsule, ...]:
        """From the flange to each target that is not on it."""
        return tuple(
            Capsule(self.flange, self.flange + 1 + k, TARGET_RADIUS, tool=True)
            for k in range(len(self.targets))
            if self.along[self.flange + 1 + k] - self.along[self.flange] >= _SMALL
        )

    def moved_by(self, point: int) -> range:
        """Return the joints, from 0, that move a point."""
        return range(min(point - 1, self.joints)) if point <= self.flange else range(self.joints)

    def _last_at(self, point: int) -> int:
        """Return the last of the points that lie where this one lies."""
        while point < self.flange and self.lengths[point + 1] < _SMALL:
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
