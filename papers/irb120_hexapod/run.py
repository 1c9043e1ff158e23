"""A worn IRB 120 calibrated by a tracker and judged with the hexapod device, once a seed."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from papers import Progress, regions
from papers.hexapod_place import PLACE, touched
from papers.irb120 import without_beta
from papers.irb120_hexapod.spheres import TRACKER, Spheres, spheres
from papers.irb120_hexapod.ways import Ways, ways
from papers.irb120_hexapod.worn import calibrated, in_base, tracked, worn_twin
from papers.seeds import Seed, over_seeds
from truearm.engine.data.hexapod import DEVICE, HexapodPose, leg_lengths, poses, triangle
from truearm.engine.data.statistics import Spread, errors_of
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform, rigid_motion
from truearm.engine.twin.twin import Twin
from truearm.hexapod.places import plain_frame, world_frame
from truearm.hexapod.reachable import Reachable, reachable, with_cups
from truearm.hexapod.rehearsal import SetUp, ballbar, measure_poses, set_up
from truearm.validation.pose_accuracy import PoseErrors, pose_errors, repeatability

TRAINING: Final = 38
#: What the tool was turned by, about axis 6, between calibration and test: size and side are chosen for the orientation
#: and the mean leg length of Table 3.2.
SLIPPED: Final = math.radians(0.300)
#: Wider than the ballbar's, so that what is beyond its range can be counted.
_WIDE: Final = replace(DEVICE, reach=3e-3)
#: Section 3.5: poses with the arm, poses and repetitions for repeatability.
_BY_ARM: Final = 15
POSES: Final = 4
REPEATED: Final = 5
#: Deviation of a coordinate that the measurement arm reads: invented, a FaroArm Platinum states about this [m].
_ARM: Final = 0.015e-3
#: What a joint does not repeat from one side [rad]: it makes ABB's 0.010 mm.
_JOINT: Final = 6e-6


@dataclass(frozen=True, eq=False)
class Outcome:
    """One seed."""

    tracker: Spread  #: Errors on unseen configurations after the calibration by tracker [m].
    #: session, unturned: errors of the poses that the device measures, with the turned tool and without.
    session: PoseErrors
    unturned: PoseErrors
    legs: Array  #: Lengths minus nominal, with the turned tool [m], ``(rows, 6)``.
    arm: PoseErrors  #: Errors of poses that look up, read by a measurement arm.
    #: either_side, one_side: repeatability of T1, T2, T3 and the flange [m] when joints come from either side, and from
    #: one.
    either_side: tuple[float, ...]
    one_side: tuple[float, ...]
    spheres: Spheres  #: The ballbar on a sphere.
    ways: Ways  #: Calibrations with the device.


@dataclass(frozen=True, eq=False)
class Run:
    """The whole study."""

    outcomes: tuple[Outcome, ...]  #: Of the seeds.
    designed: tuple[HexapodPose, ...]  #: The device's poses for the nominal tool.
    plan: Reachable  #: What the nominal robot reaches of them.


def run(seeds: int, progress: Progress, unseen: int, coarser: int) -> Run:
    """Calibrate and judge the robot, once a seed.

    Args:
        seeds: How many: of configurations, noise, gears and lag.
        progress: Called with a few words at each step.
        unseen: Configurations to judge calibrations by.
        coarser: Only every so many-th of the readings on the sphere, and of those of the sessions that are compared.
    """
    nominal, cups = with_cups(load_robot("irb120"))
    designed = poses(cups)
    plan = reachable(nominal, PLACE, designed, branches=("front-up",))
    return Run(over_seeds(seeds, progress, partial(_one, unseen=unseen, coarser=coarser)), designed, plan)


def _one(seed: Seed, unseen: int, coarser: int) -> Outcome:
    rng = seed.generator()
    twin = worn_twin(rng)
    nominal = load_robot("irb120").with_payload(twin.robot.payload)
    read = tracked(twin, regions.IRB120.draw(TRAINING, rng), TRACKER, rng)
    truth = tracked(twin, regions.IRB120.draw(unseen, rng), 0.0, rng)
    model = calibrated(without_beta(nominal), read)
    drive, cups = with_cups(in_base(model))
    wanted = poses(cups)
    rows = reachable(drive, PLACE, wanted, branches=("front-up",)).rows
    plan = np.array([row.joints for row in rows])
    approach = rng.choice([-1.0, 1.0], plan.shape)
    slipped = {"theta_offset_6": twin.robot.values["theta_offset_6"] + SLIPPED}
    later = replace(twin, robot=twin.robot.with_values(slipped))
    touches = touched(drive, PLACE)
    frame = world_frame(drive.world_poses(touches, "1")[0], np.full(3, DEVICE.base)).plain
    wide = ballbar(rng, _WIDE)
    fixtures = set_up(later, touches, wide)
    reached = measure_poses(later, fixtures, rows, plan, wide, approach=approach)
    asked = _in(frame, _predicted(drive, plan))
    before = set_up(twin, touches, wide)
    unturned = measure_poses(twin, before, rows, plan, wide, approach=approach)
    legs = [
        leg_lengths(row.design, triangle(fixtures.base, "B"), at) - DEVICE.leg
        for row, at in zip(rows, reached, strict=True)
    ]
    chosen = rng.choice(len(rows), POSES, replace=False)
    again = [rows[n] for n in chosen for _ in range(REPEATED)]
    joints = np.repeat(plan[chosen], REPEATED, axis=0)

    def repeated(directions: Array) -> tuple[float, ...]:
        stopped = joints + _JOINT * rng.standard_normal(joints.shape)
        found = measure_poses(twin, before, again, stopped, wide, approach=directions)
        return _repeatability(found.reshape(POSES, REPEATED, 3, 3), cups)

    beta = in_base(calibrated(nominal, read))
    _, cups_of_beta = with_cups(beta)
    return Outcome(
        tracker=Spread.of(errors_of(model, truth).position_norms),
        session=pose_errors(cups, asked, reached),
        unturned=pose_errors(cups, asked, unturned),
        legs=np.array(legs),
        arm=_by_arm(later, drive, frame, fixtures, cups, rng),
        either_side=repeated(rng.choice([-1.0, 1.0], joints.shape)),
        one_side=repeated(np.ones(joints.shape)),
        spheres=spheres(twin, model, rng, coarser),
        ways=ways(twin, nominal, beta, poses(cups_of_beta), rows, read, truth, rng, coarser),
    )


def _predicted(robot: Robot, joints: Array) -> Array:
    """Return where a model says the cups are [m], ``(n, 3, 3)``."""
    return np.stack([robot.world_poses(joints, target.name)[0] for target in robot.targets], axis=1)


def _in(frame: Transform, points: Array) -> Array:
    return np.asarray((points - np.array(frame.translation)) @ frame.rotation)


def _by_arm(
    twin: Twin, drive: Robot, frame: Transform, fixtures: SetUp, cups: Array, rng: np.random.Generator
) -> PoseErrors:
    """Return the errors of poses that look up, read by a measurement arm from the base cups."""
    q = regions.IRB120.draw(4000, rng)
    up = q[drive.world_poses(q)[1][:, 2, 2] > 0.5][:_BY_ARM]
    approach = rng.choice([-1.0, 1.0], up.shape)
    names = [target.name for target in twin.robot.targets]
    frames = [posture.targets for posture in twin.postures(up, approach=approach)]
    true = np.array([[at[name][:3, 3] for name in names] for at in frames])
    noise = _ARM * rng.standard_normal((_BY_ARM + 1, 3, 3))
    seen = plain_frame(fixtures.base_cups + noise[-1])
    return pose_errors(cups, _in(frame, _predicted(drive, up)), _in(seen, true + noise[:-1]))


def _repeatability(found: Array, cups: Array) -> tuple[float, ...]:
    """Return the largest repeatability over poses of T1, T2, T3 and the flange [m]; `found` is (poses, times, 3, 3)."""
    flange = [rigid_motion(cups, places)[1] for places in found]
    points = [list(found[:, :, cup]) for cup in range(3)]
    return tuple(max(repeatability(places) for places in each) for each in [*points, flange])
