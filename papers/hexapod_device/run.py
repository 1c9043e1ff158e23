"""What the hexapod device measures of a robot that does what its model says, once a seed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np

from papers import Progress
from papers.hexapod_place import PLACE, fixture_at, placed, touched
from papers.seeds import Seed, over_seeds
from truearm.engine.base.errors import InputError
from truearm.engine.data.hexapod import CUPS, DEVICE, SOLUTIONS, HexapodPose, poses, tool_cups
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY, Transform, rigid_motion
from truearm.engine.twin.twin import Twin
from truearm.hexapod.places import cup_monte_carlo, plain_frame
from truearm.hexapod.reachable import Reachable, reachable, with_cups
from truearm.hexapod.rehearsal import ToolChanger, ballbar, measure_poses, set_up
from truearm.hexapod.sheet import four_cups, side_frames

#: How often the tool is attached, and each pose measured.
ATTACHED: Final = 5
REPEATED: Final = 5
#: Section 3.5: by how much the bar is off when it was long not put on its calibrator [m].
_DRIFT: Final = 3e-6
#: How far before each robot the middle of a flat fixture stands [m].
_BEFORE: Final = {"irb120": 0.30, "lrmate200ic": 0.40}


@dataclass(frozen=True, eq=False)
class Outcome:
    """One seed."""

    #: Deviations of the cups by solution, in standard deviations of a length.
    monte_carlo: Mapping[int, tuple[float, float, float]]
    flange: tuple[float, float]  #: Deviation of the flange's place [m] and turn [rad].
    #: steady, each_pose, never: errors of the cups over a session [m], ``(rows, 3)``: of a bar that does not drift, of
    #: one that drifts and is put on its calibrator before each pose, and of one that never is.
    steady: Array
    each_pose: Array
    never: Array
    changer: Array  #: The same of a steady bar and a tool that is attached anew for every pose.
    attachments: Array  #: Cups after the tool was attached anew [m], ``(times, 3, 3)``.
    repeated: Array  #: Cups of poses measured again and again [m], ``(poses, times, 3, 3)``.
    #: How many times as many configurations each robot reaches with a fourth cup, by its library id.
    gain: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class Run:
    """The whole study."""

    outcomes: tuple[Outcome, ...]  #: Of the seeds.
    plan: Reachable  #: What the robot of the sessions reaches.


def run(seeds: int, progress: Progress, trials: int, *, places: bool) -> Run:
    """Measure with the device, once a seed.

    Args:
        seeds: How many: of the bar's noise, of the tool changer, and of places of a fixture with four cups.
        progress: Called with a few words at each step.
        trials: Of each Monte Carlo.
        places: Whether robots are asked what they reach with a fourth cup.
    """
    robot, cups = with_cups(load_robot("irb120"))
    plan = reachable(robot, PLACE, poses(cups), branches=("front-up",))
    return Run(over_seeds(seeds, progress, partial(_sessions, robot, plan, trials=trials, places=places)), plan)


def _sessions(robot: Robot, plan: Reachable, seed: Seed, trials: int, places: bool) -> Outcome:
    rng = seed.generator()
    twin = Twin(robot)
    joints = np.array([row.joints for row in plan.rows])
    fixtures = set_up(twin, touched(robot, PLACE), ballbar(rng))
    true = _cups(twin, joints, plain_frame(fixtures.base_cups))
    drift = _DRIFT / (6 * len(joints))

    def errors(drifting: float, *, initialise: bool = True, changer: ToolChanger | None = None) -> Array:
        bar = ballbar(rng, drift=drifting)
        found = measure_poses(twin, fixtures, plan.rows, joints, bar, initialise=initialise, changer=changer)
        return np.asarray(np.linalg.norm(found - true, axis=2))

    steady, each_pose = errors(0.0), errors(drift)
    never, changer = errors(drift, initialise=False), errors(0.0, changer=ToolChanger(rng))
    chosen = rng.choice(len(joints), 4, replace=False)
    rows = [plan.rows[row] for row in chosen for _ in range(REPEATED)]
    bar = ballbar(rng)
    repeated = measure_poses(twin, fixtures, rows, np.repeat(joints[chosen], REPEATED, axis=0), bar)
    attaching = ToolChanger(rng)
    attached = np.array([_cups(attaching.attached(twin), joints[:1], IDENTITY)[0] for _ in range(ATTACHED)])
    return Outcome(
        monte_carlo={solution: cup_monte_carlo(solution, trials, rng) for solution in SOLUTIONS},
        flange=_flange(trials, rng),
        steady=steady,
        each_pose=each_pose,
        never=never,
        changer=changer,
        attachments=attached,
        repeated=repeated.reshape(4, REPEATED, 3, 3),
        gain={name: _gain(name, rng) for name in _BEFORE} if places else {},
    )


def _cups(twin: Twin, joints: Array, frame: Transform) -> Array:
    """Return the true cups in a frame of the twin's world [m], ``(n, 3, 3)``."""
    names = [target.name for target in twin.robot.targets]
    at = [twin.target_frames(reading) for reading in joints]
    world = np.array([[frames[name][:3, 3] for name in names] for frames in at])
    return np.asarray((world - np.array(frame.translation)) @ frame.rotation)


def _flange(trials: int, rng: np.random.Generator) -> tuple[float, float]:
    """Return the standard deviation of the flange's place [m] and of its turn [rad], each over all axes together.

    Worst of the document's solutions, for its design and its tool.
    """
    worst = np.zeros(2)
    for pose in (p for p in poses() if p.design.name == "112212331"):
        lengths = np.repeat([DEVICE.base, DEVICE.tool, DEVICE.leg], (3, 3, 6))[:, None]
        d = lengths + DEVICE.sigma * rng.standard_normal((12, trials // 10))
        cups = tool_cups(pose.design, pose.solution, d[:3], d[3:6], d[6:])
        R, p = rigid_motion(CUPS, np.moveaxis(cups, -1, 0))
        turned = np.swapaxes(R, 1, 2) @ pose.rotation
        small = np.array([turned[:, 2, 1], turned[:, 0, 2], turned[:, 1, 0]])
        worst = np.maximum(worst, [math.sqrt(p.var(axis=0).sum()), math.sqrt(small.var(axis=1).sum())])
    return float(worst[0]), float(worst[1])


def _gain(name: str, rng: np.random.Generator) -> float:
    """Return how many times as many configurations a robot reaches with the fourth cup, at a place drawn for it."""
    robot, cups = with_cups(load_robot(name))
    wanted = poses(cups)
    place = fixture_at((_BEFORE[name], rng.uniform(-0.1, 0.1), rng.uniform(0.1, 0.3)), rng.uniform(-180.0, 180.0))
    cups_of_four = four_cups(np.full(3, DEVICE.base), np.full(3, DEVICE.base))
    counts = [_reached(robot, placed(place, frame), wanted) for frame in side_frames(cups_of_four)]
    return sum(counts) / counts[0]


def _reached(robot: Robot, place: Transform, wanted: Sequence[HexapodPose]) -> int:
    try:
        return len(reachable(robot, place, wanted).rows)
    except InputError:  # a side of the tetrahedron may face away from the robot
        return 0
