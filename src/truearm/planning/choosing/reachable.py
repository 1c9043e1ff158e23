"""Which candidates an arm can be driven to: found for those that are chosen, as a way around takes long to find."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.planning.driving.touring import unreached
from truearm.planning.driving.ways import WayFinder

#: After as many choices with configurations that have no way, those are chosen from whose ways are known.
_ROUNDS: Final = 3
#: So many times as many as are chosen are enough to choose from, and so many ways around are looked for to have them.
_ENOUGH: Final = 10
_TRIED: Final = 300
_AT_ONCE: Final = 30
#: As many ways tell what is in the way most often.
_TOLD: Final = 200

Indices = NDArray[np.intp]


class Reachable:
    """Candidates as they are found to have a way from the safe configuration, or none.

    Args:
        finder: Finds the ways.
        joints: The candidates, ``(n, joints)`` [rad or m].
        before: Where the arm stops right before each, ``(n, joints)``.
    """

    def __init__(self, finder: WayFinder, joints: Array, before: Array) -> None:
        self.finder, self.joints, self.before = finder, joints, before
        self.known = np.zeros(len(joints), bool)
        self.lost = np.zeros(len(joints), bool)

    def look(self, at: Indices) -> None:
        """Look for the ways to candidates, as far as they are not known."""
        at = at[~(self.known | self.lost)[at]]
        if len(at):
            without = unreached(self.finder, self.joints[at], self.before[at])
            self.known[at] = True
            self.known[at[without]] = False
            self.lost[at[without]] = True

    def with_straight_ways(self, at: Indices, wanted: int, progress: Callable[[str], None]) -> Indices:
        """Return those of candidates to which a way is known: all with straight ones, and others until it is enough.

        Args:
            at: To choose from, in any order.
            wanted: How many are chosen.
            progress: Called with a few words at each step.
        """
        progress(f"looking which of {len(at)} configurations are driven to straight")
        check, left = self.finder.check, at[~(self.known | self.lost)[at]]
        home = np.broadcast_to(self.finder.home, self.joints.shape)
        for start, end in ((self.joints, home), (self.before, home), (self.before, self.joints)):
            left = left[check.ways(start[left], end[left]).clear]
        self.known[left] = True
        others = np.random.default_rng(0).permutation(at[~(self.known | self.lost)[at]])[:_TRIED]
        while self.known[at].sum() < _ENOUGH * wanted and len(others):
            progress(f"looking for ways around, {int(self.known[at].sum())} configurations to choose from so far")
            self.look(others[:_AT_ONCE])
            others = others[_AT_ONCE:]
        return at[self.known[at]]

    def refuse_too_few(self, usable: Indices, wanted: int) -> None:
        """Refuse where there are not as many candidates with ways as shall be chosen."""
        reached = int(self.known[usable].sum())
        if reached >= wanted:
            return
        at = usable[~self.known[usable]][:_TOLD]
        looked = self.finder.check.ways(
            self.joints[at], np.broadcast_to(self.finder.home, (len(at), len(self.finder.home)))
        )
        ways = Counter(self.finder.check.words(int(k)) for k in looked.worst[~looked.clear])
        most = "".join(f"; on the straight ones most often {what}" for what, _ in ways.most_common(1))
        raise InputError(
            "too few configurations have a way from the safe one on which the arm keeps clear",
            parameter="home",
            came=f"{reached} of {len(usable)}{most}",
            allowed=f"{wanted} or more",
            cure="Name another safe configuration (`home`), lower `clearance`, see that boxes and floor leave room for "
            "ways, or give more `candidates`.",
        )


def chosen_with_ways(
    choose: Callable[[Indices], Indices],
    usable: Indices,
    reachable: Reachable | None,
    poses: int,
    progress: Callable[[str], None],
) -> tuple[Indices, dict[str, int]]:
    """Choose among candidates until there is a way to each that is chosen.

    Those without a way are left out, and it is chosen again; after some rounds only those count whose ways are known.

    Args:
        choose: Returns which of some candidates are best; it may refuse.
        usable: Which candidates there are.
        reachable: What is known of their ways; None for no need of any.
        poses: How many are chosen at least.
        progress: Called with a few words at each step.

    Returns:
        Which are chosen; and how many were left out, by why.

    Raises:
        InputError: If there are fewer with ways than are chosen, with what is in the way.
    """
    left = usable
    progress(f"choosing among {len(left)} configurations")
    found = choose(left)
    if reachable is None:
        return found, {}
    straight = 0
    for number in range(1, _ROUNDS + 1):
        progress(f"looking for ways that keep clear, round {number}")
        reachable.look(found)
        lost = int(reachable.lost[found].sum())
        if not lost:
            break
        left = left[~reachable.lost[left]]
        if number == _ROUNDS or len(left) < poses:
            every = len(left)
            left = reachable.with_straight_ways(left, poses, progress)
            straight = every - int(reachable.lost[usable].sum() - (len(usable) - every)) - len(left)
            reachable.refuse_too_few(usable, poses)
        progress(f"choosing among {len(left)} configurations, as there was no way to {lost}")
        found = choose(left)
    without = int(reachable.lost[usable].sum())
    return found, {name: cost for name, cost in (("ways", without), ("straight ways", straight)) if cost}
