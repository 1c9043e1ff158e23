"""An IRB 120 calibrated with the hexapod device in several ways, beside a tracker."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Final

import numpy as np

from papers.hexapod_place import PLACE, fixture_at, placed, touched
from papers.irb120 import ELASTIC
from papers.irb120_hexapod.worn import calibrated
from papers.placements import identify_placements
from papers.seeds import Figures
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.hexapod import DEVICE, HexapodPose
from truearm.engine.data.statistics import errors_of
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform
from truearm.engine.twin.twin import Twin
from truearm.hexapod import rehearsal
from truearm.hexapod.places import plain_frame, world_frame
from truearm.hexapod.reachable import reachable
from truearm.hexapod.rehearsal import SetUp, ToolChanger, ballbar, cups_dataset, joined, measure_poses, set_up
from truearm.hexapod.sheet import PlannedRow, four_cups, side_frames

#: A fixture that lies flat before the robot, and two more at its sides.
_FLAT: Final = fixture_at((0.30, 0.0, 0.05), 0.0)
_PLACES: Final = (_FLAT, fixture_at((0.20, 0.30, 0.05), 30.0), fixture_at((0.20, -0.30, 0.05), -30.0))
#: How far the fourth cup is from its place, a coordinate [m].
_FOURTH: Final = 0.1e-3
#: A bar that is never put on its calibrator gains this much with each reading [m]: 3 um over 39 configurations.
_DRIFT: Final = 3e-6 / (6 * 39)
#: Turns in which model and frames by touches are found.
TURNS: Final = 6
#: Nearer to the middle of the poses than this is near [m] (Nubiola, 4.4).
_NEAR: Final = 0.200


@dataclass(frozen=True, eq=False)
class Bench:
    """What all sessions of a seed share."""

    twin: Twin  #: The true robot.
    nominal: Robot  #: The nominal robot, with its load.
    drive: Robot  #: As its controller has it, calibrated well enough for the range of the ballbar.
    wanted: tuple[HexapodPose, ...]  #: The device's poses for this tool.
    rng: np.random.Generator  #: For noise, lag and the tool changer.
    coarser: int  #: Only every so many-th configuration that the robot reaches.

    def at(self, place: Transform) -> tuple[Array, SetUp]:
        """Set the fixture up; return the joint positions at its cups and the fixture."""
        touches = touched(self.drive, place)
        return touches, set_up(self.twin, touches, ballbar(self.rng), np.ones(touches.shape))

    def plan(self, place: Transform) -> Sequence[PlannedRow]:
        """Return everything that the robot reaches."""
        return reachable(self.drive, place, self.wanted).rows[:: self.coarser]

    def session(
        self,
        rows: Sequence[PlannedRow],
        fixtures: SetUp,
        *,
        drift: float = 0.0,
        changer: ToolChanger | None = None,
        either_side: bool = False,
    ) -> Dataset:
        """Measure planned configurations, in the fixture's frame."""
        joints = np.array([row.joints for row in rows])
        approach = self.rng.choice([-1.0, 1.0], joints.shape) if either_side else np.ones(joints.shape)
        bar = ballbar(self.rng, drift=drift)
        cups = measure_poses(
            self.twin, fixtures, rows, joints, bar, approach=approach, initialise=not drift, changer=changer
        )
        kept = np.flatnonzero(np.isfinite(cups).all(axis=(1, 2)))
        return cups_dataset(self.drive, [str(row) for row in kept], joints[kept], cups[kept])


def ways(bench: Bench, few_rows: Sequence[PlannedRow], tracker: Dataset, unseen: Dataset) -> Figures:
    """Calibrate in all ways.

    Args:
        bench: What all sessions share.
        few_rows: What is measured at the place of section 3.5.
        tracker: What a tracker read to calibrate from.
        unseen: True positions to judge by, in the twin's world.

    Returns:
        Error of each cup over unseen configurations and over those near the fixture [mm], and from how many
        configurations, by way.
    """
    nominal = bench.nominal
    sessions = [(*bench.at(place), bench.plan(place)) for place in _PLACES]
    _, first, flat = sessions[0]
    data = [bench.session(rows, fixtures) for _, fixtures, rows in sessions]
    _, tilted = bench.at(PLACE)
    by_touch = [(t, fixtures.base) for t, fixtures, _ in sessions]
    middle = first.base_cups.mean(axis=0) + 0.245 * plain_frame(first.base_cups).rotation[:, 2]
    near = np.linalg.norm(unseen.position - middle, axis=1) < _NEAR

    figures: Figures = {"everywhere": {}, "near": {}, "configurations": {}}

    def judge(way: str, robot: Robot, configurations: int, fixtures: SetUp | None = first) -> None:
        errors = _errors(robot, unseen, fixtures)
        figures["configurations"][way] = configurations
        for table, of in (("everywhere", errors), ("near", errors[near])):
            figures[table] |= {f"{way}: mean": 1e3 * float(of.mean()), f"{way}: maximum": 1e3 * float(of.max())}

    def judge_session(way: str, part: Dataset, fixtures: SetUp | None = first) -> None:
        judge(way, calibrated(nominal, part), part.configurations, fixtures)

    one = calibrated(nominal, data[0])
    total = sum(part.configurations for part in data)
    few = bench.session(few_rows, tilted)
    all_sides = _four_sides(bench, first, flat)
    drifting = bench.session(flat, first, drift=_DRIFT)
    attached_anew = bench.session(flat, first, changer=ToolChanger(bench.rng))
    either_side = bench.session(flat, first, either_side=True)
    turns = [one]
    for _ in range(TURNS):
        turns.append(calibrated(nominal, _by_touches(turns[-1], data, by_touch)))
    judge_session("tracker", tracker, None)
    judge_session("one place, 22 poses", few, tilted)
    judge("one place", one, data[0].configurations)
    judge("three places", identify_placements(nominal, data, ELASTIC).robot, total)
    judge("three places, frames by touches", turns[1], total)
    judge("three places, frames by touches, in turn", turns[-1], total)
    judge_session("four cups", all_sides)
    judge_session("one place, bar never put on its calibrator", drifting)
    judge_session("one place, tool attached anew for every pose", attached_anew)
    judge_session("one place, joints come from either side", either_side)
    return figures


def _four_sides(bench: Bench, first: SetUp, flat: Sequence[PlannedRow]) -> Dataset:
    """Return what is measured on all sides of a fixture with a fourth cup, in the frame of the first side."""
    nominal = four_cups(np.full(3, DEVICE.base), np.full(3, DEVICE.base))
    seen = plain_frame(first.base_cups)
    place = seen.rotation @ nominal[3] + np.array(seen.translation) + _FOURTH * bench.rng.standard_normal(3)
    sides = rehearsal.with_fourth(first, place, ballbar(bench.rng))
    parts = []
    for number, (frame, (fixtures, true)) in enumerate(zip(side_frames(nominal), sides, strict=True)):
        part = bench.session(bench.plan(placed(_FLAT, frame)) if number else flat, fixtures)
        labels = tuple(f"{number}-{label}" for label in part.labels)
        position = part.position @ true.rotation.T + np.array(true.translation)
        parts.append(replace(part, labels=labels, position=position))
    return reduce(joined, parts)


def _by_touches(robot: Robot, places: Sequence[Dataset], touches: Sequence[tuple[Array, Array]]) -> Dataset:
    """Return the readings of all places in the frame of the first, by the joint positions at their cups and a model."""
    name = robot.targets[0].name
    frames = [world_frame(robot.world_poses(at, name)[0], sides).frame for at, sides in touches]
    first = frames[0]
    moved = []
    for data, frame in zip(places, frames, strict=True):
        world = data.position @ frame.rotation.T + np.array(frame.translation)
        moved.append(replace(data, position=(world - np.array(first.translation)) @ first.rotation))
    return reduce(joined, moved)


def _errors(robot: Robot, unseen: Dataset, fixtures: SetUp | None) -> Array:
    """Return the errors of a robot whose world is that of the tracker, or of a fixture."""
    if fixtures is None:
        return errors_of(robot, unseen).position_norms
    frame = plain_frame(fixtures.base_cups)
    there = replace(unseen, position=(unseen.position - np.array(frame.translation)) @ frame.rotation)
    return errors_of(robot, there).position_norms
