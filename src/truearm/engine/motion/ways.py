"""Ways that keep clear, and configurations drawn where an arm can be driven."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.motion.collisions import CollisionCheck
from truearm.engine.robot.chain import Array

# Ways from one configuration to the next that keep clear, with configurations in between where they must go around.
#
# Ways are looked for in a fixed order, the simplest first: straight; around over one configuration in which some joints
# already stand where they will and the others where they were; over the safe configuration; over configurations with
# much room. Which configuration is measured after which is decided before, and stays.

#: Of the ways around, how many are looked at together, the shortest first.
_TOGETHER: Final = 64
#: How many configurations far from everything are gone over at most.
_MOST_FAR: Final = 48
_DRAWN: Final = 600


@dataclass(frozen=True, eq=False)
class Way:
    """A way that keeps clear."""

    over: Array  #: Configurations in between, ``(k, joints)``; none of a straight way.
    distance: float  #: The smallest distance on it [m].


class WayFinder:
    """Finds ways that keep clear, from a safe configuration on.

    Args:
        check: What is kept clear of what.
        home: The safe configuration, ``(joints,)`` [rad or m].
        low, high: Between which joints stay, each ``(joints,)``.
    """

    def __init__(self, check: CollisionCheck, home: Array, low: Array, high: Array) -> None:
        self.check, self.home = check, home
        self.low, self.high = low, high
        self._far: tuple[Array, list[Way]] | None = None
        joints = len(home)
        self._shares = np.array([[(n >> j) & 1 for j in range(joints)] for n in range(1, 2**joints - 1)], bool)

    def between(self, starts: Array, ends: Array) -> list[Way | None]:
        """Return a way for each pair of configurations, each ``(n, joints)``; None where none was found."""
        ways = self._straight(starts, ends)
        for k in [k for k, way in enumerate(ways) if way is None]:
            ways[k] = self._around(starts[k], ends[k])
        left = [k for k, way in enumerate(ways) if way is None]
        if left:
            out, back = (self.home_from(at) for at in (starts[left], ends[left]))
            for k, leave, come in zip(left, out, back, strict=True):
                if leave is not None and come is not None:
                    over = np.concatenate([leave.over, self.home[None], come.over[::-1]])
                    ways[k] = Way(over, min(leave.distance, come.distance))
        return ways

    def home_from(self, at: Array) -> list[Way | None]:
        """Return a way from each configuration ``(n, joints)`` to the safe one; None where none was found."""
        home = np.broadcast_to(self.home, at.shape)
        ways = self._straight(at, home)
        for k in [k for k, way in enumerate(ways) if way is None]:
            ways[k] = self._around(at[k], self.home) or self._over_far(at[k])
        return ways

    def _straight(self, starts: Array, ends: Array) -> list[Way | None]:
        looked = self.check.ways(starts, ends)
        none = np.zeros((0, starts.shape[1]))
        return [
            Way(none, float(gap)) if clear else None for clear, gap in zip(looked.clear, looked.distance, strict=True)
        ]

    def _around(self, start: Array, end: Array) -> Way | None:
        """Return the shortest clear way over one corner of the box of joint positions between two configurations."""
        over = np.where(self._shares, end, start)
        over = np.unique(over[((over != start).any(axis=1)) & ((over != end).any(axis=1))], axis=0)
        return self._over_one(start, end, np.concatenate([self.home[None], over]))

    def _over_one(self, start: Array, end: Array, over: Array) -> Way | None:
        over = over[self.check.smallest_distance(over) >= self.check.need]
        long = np.abs(over - start).max(axis=1, initial=0.0) + np.abs(end - over).max(axis=1, initial=0.0)
        over = over[np.argsort(long.round(9), kind="stable")]
        for few in (over[k : k + _TOGETHER] for k in range(0, len(over), _TOGETHER)):
            outward = self.check.ways(np.broadcast_to(start, few.shape), few)
            left = np.flatnonzero(outward.clear)
            on = self.check.ways(few[left], np.broadcast_to(end, few[left].shape))
            if on.clear.any():
                k = int(np.argmax(on.clear))
                return Way(few[left[k]][None], float(min(outward.distance[left[k]], on.distance[k])))
        return None

    def _over_far(self, start: Array) -> Way | None:
        """Return a way home over a configuration far from everything, from which the way home is straight."""
        far, ways = self._far_configurations()
        if not len(far):
            return None
        nearest = np.argsort(np.abs(far - start).max(axis=1), kind="stable")
        outward = self.check.ways(np.broadcast_to(start, far.shape), far[nearest])
        for k in np.flatnonzero(outward.clear):
            on = ways[nearest[k]]
            return Way(np.concatenate([far[nearest[k]][None], on.over]), min(float(outward.distance[k]), on.distance))
        return None

    def _far_configurations(self) -> tuple[Array, list[Way]]:
        """Return configurations far from everything, and their ways home."""
        if self._far is None:
            drawn = np.random.default_rng(0).uniform(self.low, self.high, (_DRAWN, len(self.low)))
            distance = self.check.smallest_distance(drawn)
            most = np.argsort(-distance, kind="stable")[:_MOST_FAR]
            most = most[distance[most] >= self.check.need]
            at = drawn[most]
            ways = self._straight(at, np.broadcast_to(self.home, at.shape))
            known = [(k, way) for k, way in enumerate(ways) if way is not None]
            self._far = at[[k for k, _ in known]], [way for _, way in known]
        return self._far


#: So many times as many as are wanted are drawn at most, but no more than this where twice as many are enough.
_TIMES: Final = 40
_MOST: Final = 200_000
#: A message names no more of what configurations were lost to.
_MOST_NAMED: Final = 5


@dataclass(frozen=True, eq=False)
class Drawn:
    """Configurations that were drawn and are clear."""

    joints: Array  #: ``(n, joints)`` [rad or m].
    tried: int  #: How many were drawn.
    wanted: int  #: How many should be clear.
    #: How many came near the floor, a box (``keep_out`` and its name), the arm's own links, or where the arm stops
    #: right before them to one of these (``approach``); each is lost to one thing alone, the floor first.
    lost: Mapping[str, int]

    @property
    def words(self) -> str:
        """What most were lost to, and how many; nothing if none was."""
        most_first = [item for item in sorted(self.lost.items(), key=lambda item: -item[1]) if item[1]]
        named = [f"{name} {number}" for name, number in most_first[:_MOST_NAMED]]
        others = sum(number for _, number in most_first[_MOST_NAMED:])
        return ", ".join([*named, f"others {others}"] if others else named)


def drawn_clear(finder: WayFinder, count: int, approach: Array, rng: np.random.Generator) -> Drawn:
    """Draw configurations that keep clear, and from which the arm comes straight to the safe one.

    They are drawn evenly. Where fewer than half of those that are clear have a straight way, all that are clear count.

    Args:
        finder: What is kept clear, the safe configuration and the limits.
        count: How many are wanted; there are fewer if the cell leaves little room.
        approach: How far before a configuration each joint stops, to come to it moving forward, ``(joints,)`` [rad or
            m].

    Raises:
        InputError: If none was found that is clear.
    """
    low, high = finder.low, finder.high
    first = np.minimum(low + approach, (low + high) / 2.0)
    lost: dict[str, int] = {}
    straight, clear = np.zeros((0, len(low))), np.zeros((0, len(low)))
    drawn, most = 0, min(_TIMES * count, max(_MOST, 2 * count))
    while drawn < most and len(straight) < count:
        q = rng.uniform(first, high, (count, len(low)))
        drawn += count
        q, cost = finder.check.sifted(q)
        for name, number in cost.items():
            lost[name] = lost.get(name, 0) + number
        entered = finder.check.ways(np.maximum(q - approach, low), q).clear
        lost["approach"] = lost.get("approach", 0) + int(np.sum(~entered))
        q = q[entered]
        home = np.broadcast_to(finder.home, q.shape)
        ways = finder.check.ways(q, home).clear
        straight, clear = np.concatenate([straight, q[ways]]), np.concatenate([clear, q])
    configurations = straight if 2 * len(straight) >= len(clear) else clear
    result = Drawn(configurations[:count], drawn, count, lost)
    if not len(clear):
        raise InputError(
            "there is no configuration in which the arm keeps clear",
            parameter="clearance",
            came=f"{drawn} drawn; rejected by {result.words}",
            cure="Lower `clearance`, or see that the limits, the floor and boxes to keep out of leave the arm room.",
        )
    return result
