"""A whole campaign of tests by ISO 9283 on a twin that moves: what the instrument would have read, row by row.

A path is followed once for each velocity and load. From cycle to cycle the joints are a little elsewhere, the run is a
little slower or faster, and the instrument reads with noise. The drift is measured first, from cold; where it is not
planned, the arm has warmed up before. The criteria have no part in this: how they are evaluated is not known here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.limits import refuse_beyond
from truearm.measurement.performance.records import AttainedPoses
from truearm.modeling.chain import Array
from truearm.modeling.parts import Payload
from truearm.modeling.transform import Transform, homogeneous
from truearm.planning.iso9283.planned import PerformancePlan, PlannedTest
from truearm.simulation.moving.arm import DRIVES, WARMING, Drives, Motion, MovingArm, Warming
from truearm.simulation.moving.interpolator import Pace, joint_move
from truearm.simulation.twin import Twin
from truearm.validation.iso9283.controller_commands import path_commands, zone_of
from truearm.validation.iso9283.simulated_readings import (
    Pushed,
    SimulatedCampaign,
    Stand,
    Stream,
    Tracker,
    poses_of,
    pushes_of,
    samples_of,
)

#: The controller commands so often [s].
_STEP: Final = 1e-3
#: Each so many commands a correction is computed, and evenly changed between.
_CORRECTED: Final = 10
#: A joint that is commanded further in a millisecond has changed its posture [rad or m].
_JUMP: Final = 0.1
#: The arm stands before it is read, before and behind a path, and behind a move that is watched [s].
_DWELL: Final = 3.0
_BEFORE: Final = 0.3
_BEHIND: Final = 0.5
_WATCHED: Final = 1.0
#: From one group of cycles to the next where the drift is watched [s].
_BETWEEN_GROUPS: Final = 1800.0
#: Pushes in shares of the rated load.
_PUSHES: Final = tuple(k / 10 for k in range(11))
_GRAVITY: Final = 9.80665
#: How many robots are exchanged.
ROBOTS: Final = 5

#: Joint positions to command for poses of the tip ``(n, 4, 4)`` in the base frame, carrying a mass [kg], near to those
#: of the nominal robot ``(n, joints)``.
Corrected = Callable[[float, Array, Array], Array]


@dataclass(frozen=True, eq=False)
class TrueRobot:
    """A robot as it is.

    Attributes
    ----------
    twin
        Its truth, where it stands in the instrument's frame.
    tip
        Where the tip is on its flange.
    compliance
        As :class:`truearm.simulation.moving.arm.MovingArm` has it.
    """

    twin: Twin
    tip: Transform
    compliance: tuple[float, ...] = ()


def simulated_campaign(
    plan: PerformancePlan,
    robots: Sequence[TrueRobot],
    base: Array,
    tracker: Tracker,
    rng: np.random.Generator,
    *,
    corrected: Corrected | None = None,
    drives: Drives = DRIVES,
    warming: Warming = WARMING,
    progress: Callable[[str], None] = lambda _: None,
) -> SimulatedCampaign:
    """Run every test of a plan on twins.

    Parameters
    ----------
    plan
        What is commanded.
    robots
        The robot under test; where the exchange of robots is tested, all that are exchanged.
    base
        The robot's base frame in the instrument's, ``(4, 4)`` [m]: pushes are along its axes.
    tracker
        What reads the tip.
    rng
        For what is drawn.
    corrected
        Joint positions to command in place of the nominal robot's.
    drives, warming
        What the truths do not say.
    progress
        Called with a few words at each test.

    Raises
    ------
    InputError
        If a truth has other joints than the plan's robot, a pose or path cannot be commanded, or there would be too
        many samples.
    """
    cell = _Cell(plan, robots, base, tracker, rng, corrected, drives, warming)
    drift = plan.test("dAP")
    ordered = [*([drift] if drift else []), *(test for test in plan.tests if test.id != "dAP")]
    for number, test in enumerate(ordered, 1):
        cell.say = partial(_say, progress, f"test {number} of {len(ordered)}")
        cell.run(test)
    return cell.read()


class _Cell:
    """The robots, their controller, the instrument and the clock."""

    def __init__(
        self,
        plan: PerformancePlan,
        robots: Sequence[TrueRobot],
        base: Array,
        tracker: Tracker,
        rng: np.random.Generator,
        corrected: Corrected | None,
        drives: Drives,
        warming: Warming,
    ) -> None:
        self.plan, self.robots, self.base, self.tracker, self.rng = plan, robots, base, tracker, rng
        self.corrected, self.drives, self.warming = corrected, drives, warming
        self.now, self.samples = 0.0, 0
        self.say: Callable[[str], None] = lambda _: None
        self.ahead = 0.0 if plan.test("dAP") is not None else np.inf
        self.stands: list[Stand] = []
        self.paths: list[Stream] = []
        self.settling: list[Stream] = []
        self.pushes: list[Pushed] = []
        self.arms: dict[tuple[int, float], MovingArm] = {}
        self.commands: dict[tuple[str, float], Array] = {}
        self.motions: dict[tuple[object, ...], Motion] = {}

    def run(self, test: PlannedTest) -> None:
        """Run a test."""
        self.say(test.id)
        if test.id == "dAP":
            self._drift(test)
        elif test.id == "vAP":
            for load, velocity in _conditions(test):
                for place in test.places:
                    for cycle in range(1, test.cycles + 1):
                        for approach in test.approaches:
                            start = self._joints(f"{place} from {approach}", load)
                            self._stand(test, 0, place, cycle, approach, velocity, load, start)
        elif test.id in ("t", "posing-time"):
            self._settle(test)
        elif test.id == "compliance":
            self._push(test)
        elif test.id in ("AP", "AD", "E"):
            for robot in range(ROBOTS if test.id == "E" else 1):
                for load, velocity in _conditions(test):
                    came = self._joints(test.places[0] if len(test.places) > 1 else self._other(test.places[0]), load)
                    for cycle in range(1, test.cycles + 1):
                        for place in reversed(test.places):
                            came = self._stand(test, robot, place, cycle, "", velocity, load, came)
        else:
            self._along_paths(test)

    # -- poses ---------------------------------------------------------------------------------------------

    def _drift(self, test: PlannedTest) -> None:
        """Measure groups of cycles from cold, every half hour; cycles are counted through all groups."""
        load, velocity = test.loads[0], test.velocities[0]
        place = test.places[0]
        away = self._joints(self._other(place), load)
        cycle, begin = 0, self.now
        while self.now - begin <= self.plan.hours * 3600.0:
            group = self.now
            for _ in range(test.cycles):
                cycle += 1
                self._stand(test, 0, place, cycle, "", velocity, load, away)
            self.now = max(self.now, group + _BETWEEN_GROUPS)

    def _stand(
        self,
        test: PlannedTest,
        robot: int,
        place: str,
        cycle: int,
        approach: str,
        velocity: float,
        load: float,
        came: Array,
    ) -> Array:
        """Go to a pose and note where the arm stands; return what was commanded."""
        joints = self._joints(place, load)
        way = joints - came
        fast, change = self.drives.velocity * velocity, self.drives.acceleration
        longest = float(np.abs(way).max())
        self.now += longest / fast + fast / change + _DWELL
        scatter = self._scatter(len(joints))
        self.stands.append(
            Stand(
                test.id,
                robot,
                place,
                cycle,
                approach,
                velocity,
                load,
                self.now,
                self.now + self.ahead,
                joints + scatter,
                np.where(np.abs(way) > 1e-9, np.sign(way), 0.0),
            )
        )
        return joints

    def _scatter(self, joints: int) -> Array:
        return np.asarray(self.rng.normal(0.0, self.drives.scatter, joints))

    def _other(self, place: str) -> str:
        """Return a pose to come from: of the measuring points the last other one."""
        others = [name for name in self.plan.poses if name != place]
        if not others:
            raise InputError(
                "the plan has one pose alone, and there is none to come from",
                parameter="plan",
                came=place,
                allowed="two poses or more",
            )
        return "P5" if "P5" in others else others[-1]

    def _joints(self, name: str, load: float) -> Array:
        """Return what is commanded for a pose of the plan, or for where an approach begins."""
        key = (name, load)
        if key not in self.commands:
            starts = {f"{pose} from {way}": start for (pose, way), start in self.plan.starts.items()}
            poses = {**self.plan.poses, **starts}
            if name not in poses:
                raise InputError("the plan has no such pose", parameter="plan", came=name, allowed=", ".join(poses))
            pose = poses[name]
            frame = homogeneous(pose.rotation[None], pose.position[None])
            joints = pose.joints[None]
            if self.corrected is not None:
                joints = self.corrected(load * self.plan.rated_load, frame, joints)
            self.commands[key] = joints[0]
        return self.commands[key]

    def _arm(self, robot: int, load: float) -> MovingArm:
        key = (robot, load)
        if key not in self.arms:
            true = self.robots[robot]
            mass = load * self.plan.rated_load
            payload = Payload(mass, true.tip.translation if mass else (0.0, 0.0, 0.0))
            nominal, target = self.plan.robot, self.plan.target
            self.arms[key] = MovingArm(
                nominal, target, true.twin, true.tip, payload, self.drives, self.warming, true.compliance
            )
        return self.arms[key]

    # -- motions -------------------------------------------------------------------------------------------

    def _settle(self, test: PlannedTest) -> None:
        """Watch how the tip comes to rest: at a pose, or at others to which it goes from there."""
        for load, velocity in _conditions(test):
            place = test.places[0]
            ways = [(self._other(place), place)] if test.id == "t" else [(place, end) for end in test.approaches]
            for start, end in ways:
                motion = self._move(start, end, velocity, load, whole=test.id == "posing-time")
                for cycle in range(1, test.cycles + 1):
                    self._cycle(self.settling, test.id, end, cycle, velocity, load, motion)

    def _move(self, start: str, end: str, velocity: float, load: float, *, whole: bool) -> Motion:
        fast, change = self.drives.velocity * velocity, self.drives.acceleration
        command = joint_move(self._joints(start, load), self._joints(end, load), fast, change, _STEP)
        arrived = _STEP * (len(command) - 1)
        # Of a long way its end is watched; how long the move takes is told by the whole of it.
        watched = self._times(arrived + _WATCHED, _BEFORE)
        time = watched if whole else watched[watched >= arrived - _WATCHED]
        return self._arm(0, load).in_motion(command, _STEP, time, self.now + self.ahead)

    def _along_paths(self, test: PlannedTest) -> None:
        for load, velocity in _conditions(test):
            for place in test.places:
                self.say(f"{test.id}, {place} at {velocity:.0%} of the velocity")
                motion = self._path_motion(test, place, velocity, load)
                for cycle in range(1, test.cycles + 1):
                    self._cycle(self.paths, test.id, place, cycle, velocity, load, motion)

    def _path_motion(self, test: PlannedTest, place: str, velocity: float, load: float) -> Motion:
        path = self.plan.paths.get(place)
        if path is None:
            raise InputError(
                "the plan has no such path", parameter="plan", came=place, allowed=", ".join(self.plan.paths) or None
            )
        reoriented, zone = test.id == "AT-reorientation", zone_of(test.id, path)
        key = (place, reoriented, zone, velocity, load)
        if key not in self.motions:
            pace = Pace(velocity * self.plan.rated_velocity, zone=zone)
            commands = path_commands(path, pace, _STEP, reoriented=reoriented)
            arm = self._arm(0, load)
            frames = homogeneous(commands.rotation, commands.position)
            near = min(self.plan.poses.values(), key=lambda p: float(np.linalg.norm(p.position - frames[0, :3, 3])))
            joints = arm.joints_for(frames, near.joints)
            if len(joints) > 1 and np.abs(np.diff(joints, axis=0)).max() > _JUMP:
                raise InputError(
                    "the robot cannot run a path of the plan without changing its posture",
                    parameter="plan",
                    came=place,
                    cure="Plan in another cube, or with another orientation.",
                )
            if self.corrected is not None:
                joints = joints + self._correction(frames, joints, load)
            time = self._times(commands.time[-1] + _BEHIND, _BEFORE)
            self.motions[key] = arm.in_motion(joints, _STEP, time, self.now + self.ahead)
        return self.motions[key]

    def _correction(self, frames: Array, joints: Array, load: float) -> Array:
        """Return what a correction adds to joint positions along a path, ``(n, joints)``."""
        assert self.corrected is not None
        rows = np.unique(np.append(np.arange(0, len(frames), _CORRECTED), len(frames) - 1))
        added = self.corrected(load * self.plan.rated_load, frames[rows], joints[rows]) - joints[rows]
        every = np.arange(len(frames))
        return np.stack([np.interp(every, rows, column) for column in added.T], axis=1)

    def _times(self, end: float, before: float = 0.0) -> Array:
        step = 1.0 / self.tracker.rate
        return np.arange(-round(before / step), int(end / step) + 1, dtype=float) * step

    def _cycle(
        self, into: list[Stream], test: str, place: str, cycle: int, velocity: float, load: float, motion: Motion
    ) -> None:
        """Note the samples of a cycle, and let the clock run on."""
        self.samples += len(motion.time)
        refuse_beyond("samples_read", self.samples, parameter="rate")
        position, turn = motion.with_offset(self._scatter(motion.by_joints.shape[2]))
        slower = 1.0 + self.drives.pace * float(self.rng.standard_normal())
        time = self.now + (motion.time - motion.time[0]) * slower
        oriented = into is self.paths
        into.append(
            Stream(
                test,
                place,
                cycle,
                velocity,
                load,
                time,
                position + self.rng.normal(0.0, self.tracker.sigma, position.shape),
                motion.quaternion if oriented else None,
                turn + self.rng.normal(0.0, self.tracker.sigma_rot, turn.shape) if oriented else None,
            )
        )
        self.now = float(time[-1]) + _DWELL

    def _push(self, test: PlannedTest) -> None:
        """Push the tip in steps up to the rated load."""
        load = test.loads[0]
        place = test.places[0]
        joints, came = self._joints(place, load), self._joints(self._other(place), load)
        arm, force = self._arm(0, load), np.array(_PUSHES) * self.plan.rated_load * _GRAVITY
        to_base = self.robots[0].twin.robot.base.rotation.T @ self.base[:3, :3]
        for cycle in range(1, test.cycles + 1):
            for way in test.approaches:
                along = np.zeros(3)
                along["xyz".index(way[1])] = 1.0 if way[0] == "+" else -1.0
                stood = joints + self._scatter(len(joints))
                n = len(force)
                self.now += _DWELL * n
                frames = arm.at_rest(
                    np.tile(stood, (n, 1)),
                    np.tile(np.sign(joints - came), (n, 1)),
                    np.full(n, self.now + self.ahead),
                    force[:, None] * (to_base @ along),
                )
                read = frames[:, :3, 3] + self.rng.normal(0.0, self.tracker.sigma, (n, 3))
                self.pushes.append(Pushed(way, cycle, force, read))

    def read(self) -> SimulatedCampaign:
        """Return everything that was noted, as the instrument read it."""
        return SimulatedCampaign(
            self._poses_read() if self.stands else None,
            samples_of(self.paths, "simulated paths") if self.paths else None,
            samples_of(self.settling, "simulated settling") if self.settling else None,
            pushes_of(self.pushes) if self.pushes else None,
            self.now,
        )

    def _poses_read(self) -> AttainedPoses:
        stands = self.stands
        frames = np.empty((len(stands), 4, 4))
        for key in dict.fromkeys((s.robot, s.load) for s in stands):
            rows = [row for row, s in enumerate(stands) if (s.robot, s.load) == key]
            came = [stands[row] for row in rows]
            frames[rows] = self._arm(*key).at_rest(
                np.array([s.joints for s in came]),
                np.array([s.came for s in came]),
                np.array([s.working for s in came]),
            )
        return poses_of(stands, frames, self.tracker, self.rng)


def _say(progress: Callable[[str], None], test: str, words: str) -> None:
    progress(f"{test}: {words}")


def _conditions(test: PlannedTest) -> Iterator[tuple[float, float]]:
    """Give each load with each velocity."""
    return ((load, velocity) for load in test.loads for velocity in test.velocities)
