"""An IRB 120 calibrated with the hexapod device in several ways, beside a tracker."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Final

import numpy as np

from truearm.identification.hexapod.placements import identify_placements
from truearm.measurement.dataset import Dataset
from truearm.measurement.hexapod.geometry import DEVICE
from truearm.measurement.hexapod.poses import HexapodPose
from truearm.measurement.hexapod.sheet import PlannedRow
from truearm.measurement.hexapod.world_frame import plain_frame, world_frame
from truearm.measurement.statistics import errors_of
from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot
from truearm.modeling.transform import Transform
from truearm.planning.hexapod.reachable import reachable
from truearm.simulation.hexapod.fourth_cup import four_cups, side_frames, with_fourth
from truearm.simulation.hexapod.session import SetUp, cups_dataset, joined, measure_poses, set_up
from truearm.simulation.hexapod.simulated import ballbar
from truearm.simulation.hexapod.tool_changer import ToolChanger
from truearm.simulation.twin import Twin
from truearm.studies.hexapod_place import PLACE, fixture_at, placed, touched
from truearm.studies.irb120_worn import ELASTIC, calibrated
from truearm.studies.study import Row, Table

#: A fixture that lies flat before the robot, and two more at its sides.
_FLAT: Final = fixture_at((0.30, 0.0, 0.05), 0.0)
_PLACES: Final = (_FLAT, fixture_at((0.20, 0.30, 0.05), 30.0), fixture_at((0.20, -0.30, 0.05), -30.0))
#: How far the fourth cup is from its place, a coordinate [m].
_FOURTH: Final = 0.1e-3
#: A bar that is never put on its calibrator gains this much with each reading [m]: 3 um over 39 configurations.
_DRIFT: Final = 3e-6 / (6 * 39)
#: Turns in which model and frames by touches are found.
_TURNS: Final = 6
#: Nearer to the middle of the poses than this is near [m] (Nubiola, 4.4).
_NEAR: Final = 0.200
TRACKER: Final = "tracker, 38 configurations"
_ROWS: Final = {
    TRACKER: "",
    "one place, 22 poses": "The place of section 3.5.",
    "one place": "A flat fixture before the robot.",
    "three places": "Frames of the places and model are found in turn.",
    "three places, frames by touches": "Each place by the readings at its three cups and the model from the first"
    " place.",
    "three places, frames by touches, in turn": f"The same {_TURNS} times, each time with the model found before. It"
    " gets worse: what errs at the cups, up to 300 mm away from each other, turns and shifts a whole place, the model"
    " follows, and errs more at the cups.",
    "four cups": "All four sides of the tetrahedron, at one place. The bar says where they are to each other.",
    "one place, bar never put on its calibrator": "A few um among a tenth of a millimetre.",
    "one place, tool attached anew for every pose": "",
    "one place, joints come from either side": "Nothing was done against the lag of the joints.",
}


@dataclass(frozen=True, eq=False)
class Ways:
    """Calibrations of one seed.

    Attributes
    ----------
    configurations
        How many each was made from.
    everywhere, near
        Error of each cup over unseen configurations, and of those near the fixture [m].
    """

    configurations: Mapping[str, int]
    everywhere: Mapping[str, Array]
    near: Mapping[str, Array]


@dataclass(frozen=True, eq=False)
class _Bench:
    """What all sessions of a seed share."""

    twin: Twin
    told: Robot
    drive: Robot
    wanted: tuple[HexapodPose, ...]
    rng: np.random.Generator
    coarser: int

    def at(self, place: Transform) -> tuple[Array, SetUp]:
        """Set the fixture up; return the readings at its cups and the fixture."""
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


def ways(
    twin: Twin,
    told: Robot,
    drive: Robot,
    wanted: tuple[HexapodPose, ...],
    few_rows: Sequence[PlannedRow],
    tracker: Dataset,
    unseen: Dataset,
    rng: np.random.Generator,
    coarser: int = 1,
) -> Ways:
    """Calibrate in all ways.

    Parameters
    ----------
    twin
        The true robot.
    told
        The nominal robot, with its load.
    drive
        The robot as its controller has it, calibrated well enough for the range of the ballbar.
    wanted
        The device's poses for this tool.
    few_rows
        What is measured at the place of section 3.5.
    tracker
        What a tracker read to calibrate from.
    unseen
        True positions to judge by, in the twin's world.
    rng
        For noise, lag and the tool changer.
    coarser
        Only every so many-th configuration that the robot reaches.
    """
    bench = _Bench(twin, told, drive, wanted, rng, coarser)
    sessions = [(*bench.at(place), bench.plan(place)) for place in _PLACES]
    _, first, flat = sessions[0]
    data = [bench.session(rows, fixtures) for _, fixtures, rows in sessions]
    _, tilted = bench.at(PLACE)
    by_touch = [(t, fixtures.base) for t, fixtures, _ in sessions]
    one = calibrated(told, data[0])
    few = bench.session(few_rows, tilted)
    all_sides = _four_sides(bench, first, flat)
    drifted = bench.session(flat, first, drift=_DRIFT)
    changed = bench.session(flat, first, changer=ToolChanger(rng))
    lagging = bench.session(flat, first, either_side=True)
    made = {
        TRACKER: (tracker.configurations, calibrated(told, tracker), None),
        "one place, 22 poses": (few.configurations, calibrated(told, few), tilted),
        "one place": (data[0].configurations, one, first),
        "three places": (
            sum(part.configurations for part in data),
            identify_placements(told, data, ELASTIC).robot,
            first,
        ),
    }
    total = sum(part.configurations for part in data)
    turned = one
    for turn in range(_TURNS):
        turned = calibrated(told, _by_touches(turned, data, by_touch))
        if turn == 0:
            made["three places, frames by touches"] = (total, turned, first)
    made["three places, frames by touches, in turn"] = (total, turned, first)
    for name, part in (
        ("four cups", all_sides),
        ("one place, bar never put on its calibrator", drifted),
        ("one place, tool attached anew for every pose", changed),
        ("one place, joints come from either side", lagging),
    ):
        made[name] = (part.configurations, calibrated(told, part), first)
    middle = first.base_cups.mean(axis=0) + 0.245 * plain_frame(first.base_cups).rotation[:, 2]
    near = np.linalg.norm(unseen.position - middle, axis=1) < _NEAR
    errors = {name: _errors(robot, unseen, fixtures) for name, (_, robot, fixtures) in made.items()}
    return Ways(
        configurations={name: count for name, (count, *_) in made.items()},
        everywhere=errors,
        near={name: norms[near] for name, norms in errors.items()},
    )


def _four_sides(bench: _Bench, first: SetUp, flat: Sequence[PlannedRow]) -> Dataset:
    """Return what is measured on all sides of a fixture with a fourth cup, in the frame of the first side."""
    nominal = four_cups(np.full(3, DEVICE.base), np.full(3, DEVICE.base))
    seen = plain_frame(first.base_cups)
    place = seen.rotation @ nominal[3] + np.array(seen.translation) + _FOURTH * bench.rng.standard_normal(3)
    sides = with_fourth(first, place, ballbar(bench.rng))
    parts = []
    for number, (frame, (fixtures, true)) in enumerate(zip(side_frames(nominal), sides, strict=True)):
        part = bench.session(bench.plan(placed(_FLAT, frame)) if number else flat, fixtures)
        labels = tuple(f"{number}-{label}" for label in part.labels)
        position = part.position @ true.rotation.T + np.array(true.translation)
        parts.append(replace(part, labels=labels, position=position))
    return reduce(joined, parts)


def _by_touches(robot: Robot, places: Sequence[Dataset], touches: Sequence[tuple[Array, Array]]) -> Dataset:
    """Return the readings of all places in the frame of the first, by the readings at their cups and a model."""
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


# -- tables ------------------------------------------------------------------------------------------------


def ways_tables(runs: list[Ways]) -> tuple[Table, Table]:
    """Return what each way leaves everywhere, and near the fixture."""

    def rows(of: Callable[[Ways], Mapping[str, Array]], all_figures: bool) -> tuple[Row, ...]:
        made = []
        for name, why in _ROWS.items():
            count = int(np.median([run.configurations[name] for run in runs]))
            words = name if name == TRACKER else f"{name} ({count} configurations)"
            mean = [1e3 * float(of(run)[name].mean()) for run in runs]
            made.append(Row(f"{words}: mean", "mm", mean, explanation=why if all_figures else ""))
            made.append(Row(f"{words}: maximum", "mm", [1e3 * float(of(run)[name].max()) for run in runs]))
        return tuple(made)

    return (
        Table(
            "Calibrated with the device, and with a tracker: everywhere",
            "Error of the three cups over unseen configurations of the region of section 2.5, in the frame of the"
            " instrument. The document has no such figures of the IRB 120; it hoped for more than from a tracker"
            " (section 3.6), and found a third of the tracker's accuracy with the LR Mate (chapter 4).",
            rows(lambda run: run.everywhere, True),
        ),
        Table(
            "The same near the flat fixture",
            "Less than 200 mm from the middle of the poses.",
            rows(lambda run: run.near, False),
        ),
    )
