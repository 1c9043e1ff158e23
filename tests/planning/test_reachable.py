"""Choices among candidates to some of which there is no way."""

from __future__ import annotations

import numpy as np
import pytest

from truearm.engine.base.errors import InputError
from truearm.engine.motion.cell import Cell, boxes_of
from truearm.engine.motion.collisions import CollisionCheck
from truearm.engine.motion.ways import WayFinder
from truearm.engine.robot.library import load_robot
from truearm.engine.twin.truths import carrying_targets
from truearm.planning.choosing import Reachable, chosen_with_ways

HOME = np.deg2rad([90.0, 60, -30, 0, 0, 0])


@pytest.fixture(scope="module")
def walled() -> Reachable:
    """An arm on one side of a wall with a gap too narrow for it, and candidates on both sides."""
    robot = carrying_targets(load_robot("irb120"))
    inf = np.inf
    walls = {
        "front": (np.array([0.08, -0.02, -inf]), np.array([5.0, 0.02, inf])),
        "rear": (np.array([-5.0, -0.02, -inf]), np.array([-0.08, 0.02, inf])),
    }
    check = CollisionCheck(robot, Cell(-1.0, boxes_of(walls), 0.02))
    low, high = np.array([joint.range for joint in robot.joints]).T
    drawn = np.random.default_rng(1).uniform(low, high, (400, 6))
    clear = drawn[check.room(drawn) >= check.need]
    return Reachable(WayFinder(check, HOME, low, high), clear, clear)


def test_what_has_no_way_is_left_out_and_the_choices_are_bounded(walled: Reachable) -> None:
    """A choice that prefers what has no way is asked a few times, then only what is known to have one counts."""
    finder, q = walled.finder, walled.joints
    far = np.argsort(finder.check.arm.robot.forward(q)[0][:, 1])  # beyond the wall first
    rounds: list[int] = []
    said: list[str] = []

    def choose(left: np.ndarray) -> np.ndarray:
        rounds.append(len(left))
        return far[np.isin(far, left)][:3]

    reachable = Reachable(finder, q, q)
    chosen, cost = chosen_with_ways(choose, np.arange(len(q)), reachable, 3, said.append)
    assert len(chosen) == 3
    assert len(rounds) == 4
    assert sorted(rounds, reverse=True) == rounds
    assert reachable.known[chosen].all()
    assert (finder.check.arm.robot.forward(q[chosen])[0][:, 1] > 0.0).all()
    assert all(way is not None for way in finder.home_from(q[chosen]))
    assert cost["ways"] >= 9
    assert cost["ways"] + cost.get("straight ways", 0) + rounds[-1] == len(q)
    assert [words for words in said if words.startswith("looking for ways that keep clear, round ")][-1][-1] == "3"
    assert any(words.endswith("as there was no way to 3") for words in said)


def test_too_few_with_ways_are_refused_with_what_is_in_the_way(walled: Reachable) -> None:
    q = walled.joints
    beyond = np.flatnonzero(walled.finder.check.arm.robot.forward(q)[0][:, 1] < -0.1)[:12]
    with pytest.raises(
        InputError, match=r"have a way.*0 of 12; on the straight ones most often .*near the box '(front|rear)"
    ) as it:
        chosen_with_ways(lambda left: left[:4], beyond, Reachable(walled.finder, q, q), 4, lambda _: None)
    assert it.value.parameter == "home"
    assert "4 or more" in str(it.value)


def test_without_anything_to_keep_clear_of_the_first_choice_counts() -> None:
    chosen, cost = chosen_with_ways(lambda left: left[:2], np.arange(5), None, 2, lambda _: None)
    assert chosen.tolist() == [0, 1]
    assert cost == {}
