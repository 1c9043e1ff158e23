"""The cell in which tests by ISO 9283 are simulated: robots, their controller, the instrument and the clock.

What is read is noted here; which moves are made is for the tests.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.limits import refuse_beyond
from truearm.measurement.performance.records import AttainedPoses
from truearm.modeling.chain import Array
from truearm.modeling.parts import Payload
from truearm.modeling.transform import Transform, homogeneous
from truearm.planning.iso9283.planned import PerformancePlan, PlannedTest
from truearm.simulation.moving.arm import Drives, Motion, MovingArm, Warming
from truearm.simulation.twin import Twin
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
    compliance: tuple[float, ...] = ()  #: As :class:`truearm.simulation.moving.arm.MovingArm` has it.


class Cell:
    """The robots, their controller, the instrument and the clock.

    Args:
        plan, robots, base, tracker, rng, corrected, drives, warming: As for
            :func:`truearm.validation.iso9283.simulated.simulated_campaign`.
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
        came: Array,
    ) -> Array:
        """Go to a pose and note where the arm stands; return what was commanded."""
        joints = self.joints(place, load)
        way = joints - came
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
            came = [stands[row] for row in rows]
            frames[rows] = self.arm(*key).at_rest(
                np.array([s.joints for s in came]),
                np.array([s.came for s in came]),
                np.array([s.working for s in came]),
            )
        return poses_of(stands, frames, self.tracker, self.rng)


def conditions(test: PlannedTest) -> Iterator[tuple[float, float]]:
    """Give each load with each velocity."""
    return ((load, velocity) for load in test.loads for velocity in test.velocities)
