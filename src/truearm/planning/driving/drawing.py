"""Configurations drawn where an arm can be driven."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.planning.driving.ways import WayFinder

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
    found = straight if 2 * len(straight) >= len(clear) else clear
    made = Drawn(found[:count], drawn, count, lost)
    if not len(clear):
        raise InputError(
            "there is no configuration in which the arm keeps clear",
            parameter="clearance",
            came=f"{drawn} drawn; rejected by {made.words}",
            cure="Lower `clearance`, or see that the limits, the floor and boxes to keep out of leave the arm room.",
        )
    return made
