"""How near an arm comes to each thing on its ways, and what is said of what it keeps clear of."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from truearm import load_robot
from truearm.engine.motion.cell import Cell, KeepOut
from truearm.engine.motion.collisions import CollisionCheck
from truearm.engine.motion.constraints import joint_window
from truearm.engine.motion.touring import cell_notices, nearest_on
from truearm.engine.robot.robot import Robot
from truearm.planning.choosing import with_targets

TABLE = KeepOut("table", np.array([0.3, -0.2, 0.0]), np.array([0.6, 0.2, 0.3]))
BENCH = KeepOut("bench", np.array([-0.9, -0.9, -0.9]), np.array([0.9, 0.9, 0.0]))


def arm(name: str) -> Robot:
    return with_targets(load_robot(name))


@pytest.mark.parametrize("name", ["irb120", "ur5e"])
def test_distances_are_those_of_closely_spaced_postures(name: str) -> None:
    robot = arm(name)
    check = CollisionCheck(robot, Cell(boxes=(TABLE,)))
    stops = np.random.default_rng(3).uniform(*joint_window(robot), (200, 6))
    stops = stops[check.room(stops) > 0.0][:8]
    distances = nearest_on(check, stops)
    share = np.linspace(0.0, 1.0, 400)[:, None]
    rooms = check.rooms(np.concatenate([a + share * (b - a) for a, b in pairwise(stops)]))
    whats = np.array(check.whats)
    assert list(distances.values()) == sorted(distances.values())
    assert set(distances) == {"floor", "keep_out table", "links"}
    for what, room in distances.items():
        dense = rooms[whats == what].min()
        assert room <= dense
        assert room == pytest.approx(dense, abs=2e-3)


def test_at_a_single_configuration_and_with_nothing_around() -> None:
    robot = arm("irb120")
    at = np.zeros((1, 6))
    check = CollisionCheck(robot, Cell())
    assert min(nearest_on(check, at).values()) == pytest.approx(check.room(at)[0], abs=1e-3)
    assert "floor" not in nearest_on(CollisionCheck(robot, Cell(floor=None)), at)


@pytest.mark.parametrize("name", ["puma560", "ur10"])
def test_rooms_change_no_faster_than_is_taken(name: str) -> None:
    """With a little for the gap between the lines of a plate, which counts more where it is near."""
    robot = arm(name)
    post = KeepOut("post", np.array([-0.02, 0.9, -2.0]), np.array([0.02, 0.94, 2.0]))
    check = CollisionCheck(robot, Cell(boxes=(post,)))
    q = np.random.default_rng(0).uniform(*joint_window(robot), (300, 6))
    for joint in range(6):
        turned = q + 1e-3 * np.eye(6)[joint]
        far = check.rooms(q) > 0.1
        change = np.abs(check.rooms(turned) - check.rooms(q))
        assert (change <= 1.03 * check.spread(q, turned) + 1e-9)[far].all()


def test_tiny_boxes_and_boxes_out_of_reach_are_said() -> None:
    robot = arm("irb120")
    tiny = KeepOut("in metres", np.array([0.35e-3, -0.4e-3, 0.1e-3]), np.array([0.8e-3, 0.4e-3, 0.2e-3]))
    far = KeepOut("in inches", np.array([35.0, -np.inf, -np.inf]), np.full(3, np.inf))
    first, second = cell_notices(CollisionCheck(robot, Cell(boxes=(tiny, far, TABLE))))
    assert (first.code, first.level) == ("box-tiny", "warning")
    assert "longest side of the box 'in metres' is 0.8 mm" in first.message
    assert (second.code, second.level) == ("box-out-of-reach", "warning")
    assert "The box 'in inches' begins 35000 mm from the base" in second.message
    assert not cell_notices(CollisionCheck(robot, Cell(boxes=(TABLE, BENCH))))


def test_what_no_posture_keeps_apart_is_named() -> None:
    """An arm whose limits keep its tool folded over its shoulder, and a drum that turns just over a bench."""
    robot = load_robot("irb120")
    folded = [(-1.0, 1.0), (-0.1, 0.1), (0.9, 1.2), (-0.1, 0.1), (1.3, 1.5), (-1.0, 1.0)]
    joints = tuple(replace(joint, limits=limits) for joint, limits in zip(robot.joints, folded, strict=True))
    arm_ = replace(robot, joints=joints).with_frames(robot.base, {"tip": (0.0, 0.0, 0.25)})
    (notice,) = cell_notices(CollisionCheck(arm_, Cell()))
    assert (notice.code, notice.level) == ("never-apart", "note")
    assert "the link from joint 1 to joint 2 and what holds target 'tip'" in notice.message
    check = CollisionCheck(arm("ur10"), Cell(boxes=(BENCH,)))
    *_, notice = cell_notices(check)
    assert "the link from joint 2 to joint 3, next to joint 2, and the box 'bench'" in notice.message
    upright = np.deg2rad([[0.0, -90, 0, -90, 0, 0]])
    assert check.room(upright)[0] > 0.05
