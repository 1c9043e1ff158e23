"""A whole campaign of tests by ISO 9283 on a twin that moves: what the instrument would have read, row by row.

A path is followed once for each velocity and load. From cycle to cycle the joints are a little elsewhere, the run is a
little slower or faster, and the instrument reads with noise. The drift is measured first, from cold; where it is not
planned, the arm has warmed up before. The criteria have no part in this: how they are evaluated is not known here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.base.limits import refuse_beyond
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.transform import Transform, homogeneous, rotation_from_quaternion, rotation_from_vector
from truearm.engine.robot.wrench import STANDARD_GRAVITY
from truearm.engine.twin.twin import Twin
from truearm.iso9283.planning.criteria import PerformancePlan, PlannedTest
from truearm.iso9283.planning.records import AttainedPoses, Names, Pushes, Samples
from truearm.iso9283.simulating.moving_arm import (
    DRIVES,
    WARMING,
    Drives,
    Motion,
    MovingArm,
    Pace,
    Warming,
    joint_move,
    path_commands,
    zone_of,
)


@dataclass(frozen=True)
class Tracker:
    """What reads the tip."""

    sigma: float  #: Standard deviation of each coordinate [m].
    sigma_rot: float  #: Of each angle [rad].
    rate: float  #: Readings in a second [Hz].


@dataclass(frozen=True, eq=False)
class SimulatedCampaign:
    """What was read; None of what no test needs."""

    poses: AttainedPoses | None  #: poses, paths, settling, forces: in the instrument's frame.
    paths: Samples | None
    settling: Samples | None
    forces: Pushes | None
    duration: float  #: How long the campaign would take in the cell [s].


@dataclass(frozen=True, eq=False)
class Stand:
    """A pose at which the arm stands to be read."""

    criterion: str
    robot: int
    pose: str
    cycle: int
    approach: str
    velocity: float
    load: float
    time: float
    working: float
    joints: Array
    previous: Array


@dataclass(frozen=True, eq=False)
class Stream:
    """Samples of one cycle."""

    criterion: str
    place: str
    cycle: int
    velocity: float
    load: float
    time: Array
    position: Array
    quaternion: Array | None
    turn: Array | None


@dataclass(frozen=True, eq=False)
class Pushed:
    """Where the tip was in one direction and cycle, force by force."""

    direction: str
    cycle: int
    force: Array
    position: Array


def poses_of(stands: Sequence[Stand], frames: Array, tracker: Tracker, rng: np.random.Generator) -> AttainedPoses:
    """Return attained poses, as they are read where the tip stands ``(n, 4, 4)`` [m]."""
    n = len(stands)
    turned = rotation_from_vector(rng.normal(0.0, tracker.sigma_rot, (n, 3)))
    return AttainedPoses(
        Names.of(s.criterion for s in stands),
        Names.of(f"r{s.robot + 1}" if s.criterion == "E" else "" for s in stands),
        Names.of(s.pose for s in stands),
        Names.of(s.approach for s in stands),
        np.array([s.cycle for s in stands], dtype=np.intp),
        np.array([s.velocity for s in stands]),
        np.array([s.load for s in stands]),
        np.array([s.time for s in stands]),
        frames[:, :3, 3] + rng.normal(0.0, tracker.sigma, (n, 3)),
        turned @ frames[:, :3, :3],
        np.arange(2, n + 2),
        "simulated poses",
        simulated=True,
    )


def samples_of(streams: Sequence[Stream], source: str) -> Samples:
    """Return the samples of all cycles."""
    counts = [len(s.time) for s in streams]
    n = sum(counts)

    def named(texts: Sequence[str]) -> Names:
        each = Names.of(texts)
        return Names(each.names, np.repeat(each.code, counts))

    quaternions = [s.quaternion for s in streams if s.quaternion is not None]
    rotation = None
    if quaternions:
        turned = rotation_from_vector(np.concatenate([s.turn for s in streams if s.turn is not None]))
        rotation = turned @ rotation_from_quaternion(np.concatenate(quaternions))
    return Samples(
        named([s.criterion for s in streams]),
        named([s.place for s in streams]),
        np.repeat(np.array([s.cycle for s in streams], dtype=np.intp), counts),
        np.repeat([s.velocity for s in streams], counts),
        np.repeat([s.load for s in streams], counts),
        np.concatenate([s.time for s in streams]),
        np.concatenate([s.position for s in streams]),
        rotation,
        np.arange(2, n + 2),
        source,
        simulated=True,
    )


def pushes_of(pushed: Sequence[Pushed]) -> Pushes:
    """Return the readings under all pushes."""
    counts = [len(p.force) for p in pushed]
    ways = Names.of(p.direction for p in pushed)
    return Pushes(
        Names(ways.names, np.repeat(ways.code, counts)),
        np.concatenate([p.force for p in pushed]),
        np.repeat(np.array([p.cycle for p in pushed], dtype=np.intp), counts),
        np.concatenate([p.position for p in pushed]),
        np.arange(2, sum(counts) + 2),
        "simulated forces",
        simulated=True,
    )


# What is read is noted here; which moves are made is for the tests.

#: The arm stands before it is read, and behind a path [s].
DWELL: Final = 3.0

#: Joint positions to command for poses of the tip ``(n, 4, 4)`` in the base frame, carrying a mass [kg], near to those
#: of the nominal robot ``(n, joints)``.
Corrected = Callable[[float, Array, Array], Array]


@dataclass(frozen=True, eq=False)
class TrueRobot:
    """A robot as it is."""

    twin: Twin  #: Its truth, where it stands in the instrument's frame.
    tip: Transform  #: Where the tip is on its flange.
    compliance: tuple[float, ...] = ()  #: As :class:`truearm.iso9283.simulating.moving_arm.MovingArm` has it.


class Cell:
    """The robots, their controller, the instrument and the clock.

    Args:
        plan, robots, base, tracker, rng, corrected, drives, warming: As for
            :func:`truearm.iso9283.simulating.cell.simulated_campaign`.
    """

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

    def stand(
        self,
        test: PlannedTest,
        robot: int,
        place: str,
        cycle: int,
        approach: str,
        velocity: float,
        load: float,
        previous: Array,
    ) -> Array:
        """Go to a pose and note where the arm stands; return what was commanded."""
        joints = self.joints(place, load)
        way = joints - previous
        fast, change = self.drives.velocity * velocity, self.drives.acceleration
        longest = float(np.abs(way).max())
        self.now += longest / fast + fast / change + DWELL
        scatter = self.scatter(len(joints))
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

    def scatter(self, joints: int) -> Array:
        """Draw where so many joints come to rest, or run, beside where they are commanded [rad or m]."""
        return np.asarray(self.rng.normal(0.0, self.drives.scatter, joints))

    def other(self, place: str) -> str:
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

    def joints(self, name: str, load: float) -> Array:
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

    def arm(self, robot: int, load: float) -> MovingArm:
        """Return the arm of a robot with a share of the rated load."""
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

    def times(self, end: float, before: float = 0.0) -> Array:
        """Return when the instrument reads, from before the begin to the end [s], ``(n,)``."""
        step = 1.0 / self.tracker.rate
        return np.arange(-round(before / step), int(end / step) + 1, dtype=float) * step

    def note(
        self, into: list[Stream], test: str, place: str, cycle: int, velocity: float, load: float, motion: Motion
    ) -> None:
        """Note the samples of a cycle, and let the clock run on."""
        self.samples += len(motion.time)
        refuse_beyond("samples_read", self.samples, parameter="rate")
        position, turn = motion.with_offset(self.scatter(motion.by_joints.shape[2]))
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
        self.now = float(time[-1]) + DWELL

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
            chosen = [stands[row] for row in rows]
            frames[rows] = self.arm(*key).at_rest(
                np.array([s.joints for s in chosen]),
                np.array([s.previous for s in chosen]),
                np.array([s.working for s in chosen]),
            )
        return poses_of(stands, frames, self.tracker, self.rng)


def conditions(test: PlannedTest) -> Iterator[tuple[float, float]]:
    """Give each load with each velocity."""
    return ((load, velocity) for load in test.loads for velocity in test.velocities)


#: The controller commands so often [s].
_STEP: Final = 1e-3
#: Each so many commands a correction is computed, and evenly changed between.
_CORRECTED: Final = 10
#: A joint that is commanded further in a millisecond has changed its posture [rad or m].
_JUMP: Final = 0.1
#: It is read before and behind a path, and behind a move that is watched [s].
_BEFORE: Final = 0.3
_BEHIND: Final = 0.5
_WATCHED: Final = 1.0


def run_settling(cell: Cell, test: PlannedTest) -> None:
    """Watch how the tip comes to rest: at a pose, or at others to which it goes from there."""
    for load, velocity in conditions(test):
        place = test.places[0]
        ways = [(cell.other(place), place)] if test.id == "t" else [(place, end) for end in test.approaches]
        for start, end in ways:
            motion = _move(cell, start, end, velocity, load, whole=test.id == "posing-time")
            for cycle in range(1, test.cycles + 1):
                cell.note(cell.settling, test.id, end, cycle, velocity, load, motion)


def _move(cell: Cell, start: str, end: str, velocity: float, load: float, *, whole: bool) -> Motion:
    fast, change = cell.drives.velocity * velocity, cell.drives.acceleration
    command = joint_move(cell.joints(start, load), cell.joints(end, load), fast, change, _STEP)
    arrived = _STEP * (len(command) - 1)
    # Of a long way its end is watched; how long the move takes is told by the whole of it.
    watched = cell.times(arrived + _WATCHED, _BEFORE)
    time = watched if whole else watched[watched >= arrived - _WATCHED]
    return cell.arm(0, load).in_motion(command, _STEP, time, cell.now + cell.ahead)


def run_paths(cell: Cell, test: PlannedTest) -> None:
    """Run each path, once for all cycles at a velocity and a load."""
    for load, velocity in conditions(test):
        for place in test.places:
            cell.say(f"{test.id}, {place} at {velocity:.0%} of the velocity")
            motion = _path_motion(cell, test, place, velocity, load)
            for cycle in range(1, test.cycles + 1):
                cell.note(cell.paths, test.id, place, cycle, velocity, load, motion)


def _path_motion(cell: Cell, test: PlannedTest, place: str, velocity: float, load: float) -> Motion:
    path = cell.plan.paths.get(place)
    if path is None:
        raise InputError(
            "the plan has no such path", parameter="plan", came=place, allowed=", ".join(cell.plan.paths) or None
        )
    reoriented, zone = test.id == "AT-reorientation", zone_of(test.id, path)
    key = (place, reoriented, zone, velocity, load)
    if key not in cell.motions:
        pace = Pace(velocity * cell.plan.rated_velocity, zone=zone)
        commands = path_commands(path, pace, _STEP, reoriented=reoriented)
        arm = cell.arm(0, load)
        frames = homogeneous(commands.rotation, commands.position)
        near = min(cell.plan.poses.values(), key=lambda p: float(np.linalg.norm(p.position - frames[0, :3, 3])))
        joints = arm.joints_for(frames, near.joints)
        if len(joints) > 1 and np.abs(np.diff(joints, axis=0)).max() > _JUMP:
            raise InputError(
                "the robot cannot run a path of the plan without changing its posture",
                parameter="plan",
                came=place,
                cure="Plan in another cube, or with another orientation.",
            )
        if cell.corrected is not None:
            joints = joints + _correction(cell, frames, joints, load)
        time = cell.times(commands.time[-1] + _BEHIND, _BEFORE)
        cell.motions[key] = arm.in_motion(joints, _STEP, time, cell.now + cell.ahead)
    return cell.motions[key]


def _correction(cell: Cell, frames: Array, joints: Array, load: float) -> Array:
    """Return what a correction adds to joint positions along a path, ``(n, joints)``."""
    assert cell.corrected is not None
    rows = np.unique(np.append(np.arange(0, len(frames), _CORRECTED), len(frames) - 1))
    added = cell.corrected(load * cell.plan.rated_load, frames[rows], joints[rows]) - joints[rows]
    every = np.arange(len(frames))
    return np.stack([np.interp(every, rows, column) for column in added.T], axis=1)


#: From one group of cycles to the next where the drift is watched [s].
_BETWEEN_GROUPS: Final = 1800.0
#: How many robots are exchanged.
ROBOTS: Final = 5


def run_poses(cell: Cell, test: PlannedTest) -> None:
    """Go to all poses in turn, cycle by cycle; where robots are exchanged, with each of them."""
    for robot in range(ROBOTS if test.id == "E" else 1):
        for load, velocity in conditions(test):
            previous = cell.joints(test.places[0] if len(test.places) > 1 else cell.other(test.places[0]), load)
            for cycle in range(1, test.cycles + 1):
                for place in reversed(test.places):
                    previous = cell.stand(test, robot, place, cycle, "", velocity, load, previous)


def run_approaches(cell: Cell, test: PlannedTest) -> None:
    """Go to each pose from each side."""
    for load, velocity in conditions(test):
        for place in test.places:
            for cycle in range(1, test.cycles + 1):
                for approach in test.approaches:
                    start = cell.joints(f"{place} from {approach}", load)
                    cell.stand(test, 0, place, cycle, approach, velocity, load, start)


def run_drift(cell: Cell, test: PlannedTest) -> None:
    """Measure groups of cycles from cold, every half hour; cycles are counted through all groups."""
    load, velocity = test.loads[0], test.velocities[0]
    place = test.places[0]
    away = cell.joints(cell.other(place), load)
    cycle, begin = 0, cell.now
    while cell.now - begin <= cell.plan.hours * 3600.0:
        group = cell.now
        for _ in range(test.cycles):
            cycle += 1
            cell.stand(test, 0, place, cycle, "", velocity, load, away)
        cell.now = max(cell.now, group + _BETWEEN_GROUPS)


#: Pushes in shares of the rated load.
_PUSHES: Final = tuple(k / 10 for k in range(11))


def run_pushes(cell: Cell, test: PlannedTest) -> None:
    """Push the tip in steps up to the rated load."""
    load = test.loads[0]
    place = test.places[0]
    joints, previous = cell.joints(place, load), cell.joints(cell.other(place), load)
    arm, force = cell.arm(0, load), np.array(_PUSHES) * cell.plan.rated_load * STANDARD_GRAVITY
    to_base = cell.robots[0].twin.robot.base.rotation.T @ cell.base[:3, :3]
    for cycle in range(1, test.cycles + 1):
        for way in test.approaches:
            along = np.zeros(3)
            along["xyz".index(way[1])] = 1.0 if way[0] == "+" else -1.0
            stood = joints + cell.scatter(len(joints))
            n = len(force)
            cell.now += DWELL * n
            frames = arm.at_rest(
                np.tile(stood, (n, 1)),
                np.tile(np.sign(joints - previous), (n, 1)),
                np.full(n, cell.now + cell.ahead),
                force[:, None] * (to_base @ along),
            )
            read = frames[:, :3, 3] + cell.rng.normal(0.0, cell.tracker.sigma, (n, 3))
            cell.pushes.append(Pushed(way, cycle, force, read))


#: What is done in each test; in the others paths are run.
_RUNS: Final[Mapping[str, Callable[[Cell, PlannedTest], None]]] = {
    **dict.fromkeys(("AP", "AD", "E"), run_poses),
    "vAP": run_approaches,
    "dAP": run_drift,
    **dict.fromkeys(("t", "posing-time"), run_settling),
    "compliance": run_pushes,
}


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

    Args:
        plan: What is commanded.
        robots: The robot under test; where the exchange of robots is tested, all that are exchanged.
        base: The robot's base frame in the instrument's, ``(4, 4)`` [m]: pushes are along its axes.
        tracker: What reads the tip.
        rng: For what is drawn.
        corrected: Joint positions to command in place of the nominal robot's.
        drives, warming: What the truths do not say.
        progress: Called with a few words at each test.

    Raises:
        InputError: If a truth has other joints than the plan's robot, a pose or path cannot be commanded, or there
            would be too many samples.
    """
    cell = Cell(plan, robots, base, tracker, rng, corrected, drives, warming)
    drift = plan.test("dAP")
    ordered = [*([drift] if drift else []), *(test for test in plan.tests if test.id != "dAP")]
    for number, test in enumerate(ordered, 1):
        cell.say = partial(_say, progress, f"test {number} of {len(ordered)}")
        cell.say(test.id)
        _RUNS.get(test.id, run_paths)(cell, test)
    return cell.read()


def _say(progress: Callable[[str], None], test: str, words: str) -> None:
    progress(f"{test}: {words}")
