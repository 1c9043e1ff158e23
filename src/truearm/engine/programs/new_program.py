"""A new program with stops, waits, circles and speeds, for every robot language to write down.

Steps refer to targets by their number, so that a pose that is gone to thirty times stands in the program once where
the language allows it. Speeds of straight moves and circles are those of the tip; a joint motion has a share of the
joints' speed, or, in languages that say no share, a speed of the tip.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import date
from typing import Final, Literal

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.base.units import IN_PROGRAMS
from truearm.engine.programs.program import Form, correction_comment, written
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.branches import BRANCHES


# Every number has the decimals that the language's own targets have.
@dataclass(frozen=True, eq=False)
class NewTargets:
    """Targets to write."""

    name: str  #: Of the program.
    robot: str  #: For whom it is, for a comment.
    joints: Array  #: Joint positions as the controller shows them [rad; m for sliding joints], ``(n, joints)``.
    sliding: tuple[bool, ...]  #: Which joints slide.
    #: Of the controller's flange in its base frame, ``(n, 4, 4)`` [m]; None where all targets are joint positions.
    poses: Array | None
    #: Number of the branch of each pose, as in :data:`truearm.engine.robot.inverse.branches.BRANCHES`; None where they
    #: are not known.
    branches: tuple[int, ...] | None

    def words(self, row: int) -> tuple[str, str, str]:
        """Return shoulder, elbow and wrist of the posture of a pose."""
        if self.branches is None:
            raise InputError(
                "the postures of this arm have no names, and this language asks for them",
                where=self.robot,
                allowed="an arm of six joints whose wrist crosses",
                cure="Write joint positions instead of poses.",
            )
        shoulder, elbow, wrist = BRANCHES[self.branches[row]].split("-")
        return shoulder, elbow, wrist

    def axes(self, row: int, form: Form, least: int = 6) -> list[str]:
        """Return the joint positions of a target as a language writes them, zeros for those that the arm does not have.

        Args:
            form: What the language's numbers mean.
            least: How many numbers the language writes at least.
        """
        units = [form.length if slides else form.angle for slides in self.sliding]
        decimals = [form.decimals[0] if slides else form.decimals[1] for slides in self.sliding]
        values = self.joints[row].tolist()
        axes = [written(v / unit, d) for v, unit, d in zip(values, units, decimals, strict=True)]
        return axes + [written(0.0, form.decimals[1])] * (least - len(axes))

    def pose(self, row: int, form: Form) -> list[str]:
        """Return the numbers of the pose of a target as a language writes them."""
        assert self.poses is not None
        assert form.orientation is not None
        matrix = self.poses[row]
        orientation = form.orientation
        start = np.zeros((1, orientation.count))
        start[0, 0] = float(orientation.count == 4)
        numbers = orientation.nearest(matrix[None, :3, :3], start)[0]
        scale = 1.0 if orientation.count == 4 else form.angle
        turned = [written(float(v) / scale, form.decimals[1]) for v in numbers]
        return [written(float(v) / form.length, form.decimals[0]) for v in matrix[:3, 3]] + turned


def ascii_only(text: str) -> str:
    """Return a text with a question mark for what controllers may not read."""
    return re.sub(r"[^ -~]", "?", text)


# A new program: the targets of a motion, one after the other, for every robot language to write down.
#
# The first target is gone to by a joint motion, and says in which posture the arm begins. The others follow by joint
# motions, or in straight lines.

#: What a program may be called in every language: FANUC's controllers allow the fewest characters.
NAME: Final = r"[A-Za-z][A-Za-z0-9_]{0,31}"
#: Languages that have no words for the time of a joint motion.
_UNTIMED: Final = ("KRL", "INFORM", "VAL3")
#: Controllers take no shorter time than this for a move [s], and no lower speed [m/s].
_SHORTEST: Final = 1e-3
_SLOWEST: Final = 1e-4


@dataclass(frozen=True, eq=False)
class NewProgram(NewTargets):
    """The targets of a program to write, of :class:`NewTargets`, and how the robot goes to them.

    If it has poses, targets are these; else joint positions.
    """

    durations: Array  #: Time of the move to each target [s], ``(n,)``; that to the first is of no meaning.
    speeds: Array  #: Mean speed of the tip in that move [m/s], ``(n,)``.
    spacing: Array  #: Distance of the tip from the target before [m], ``(n,)``.
    corrected: bool  #: Whether the targets are corrected for one robot, which then must not be done again.
    beside: float  #: How far the tip leaves the path between the targets [m].
    simulated: bool = False  #: Whether that robot was calibrated with simulated measurements.

    def __len__(self) -> int:
        return len(self.joints)

    def untimed(self, language: str) -> bool:
        """Return whether a language has no words for the time of these moves."""
        return self.poses is None and language in _UNTIMED

    @property
    def comments(self) -> tuple[str, ...]:
        """What a person should know who opens the program, in ASCII, 32 characters at most."""
        kind = "joint positions" if self.poses is None else "poses of the flange"
        text = [f"Path for {ascii_only(self.robot)[:20]}", f"{len(self)} targets: {kind}"]
        corrected = (*correction_comment(date.today()), "do not correct it again") if self.corrected else ()
        return (*((IN_PROGRAMS,) if self.simulated else ()), *text, *corrected)

    def seconds(self, row: int) -> float:
        """Return the time of the move to a target [s]."""
        return max(float(self.durations[row]), _SHORTEST)

    def speed(self, row: int) -> float:
        """Return the speed of the tip in the move to a target [m/s]."""
        return max(float(self.speeds[row]), _SLOWEST)

    def blend(self, row: int) -> float:
        """Return how far from a target its neighbours' moves may be rounded off into each other [m]; 0 at the ends."""
        if row == 0 or row == len(self) - 1:
            return 0.0
        return float(min(1e-3, 0.4 * min(self.spacing[row], self.spacing[row + 1])))


#: What a target is written as.
TargetKind = Literal["joints", "pose"]
#: Comments of FANUC's and Yaskawa's controllers have no more characters.
LONGEST_COMMENT: Final = 32
#: FANUC's controllers wait no longer at once [s].
LONGEST_WAIT: Final = 300.0


@dataclass(frozen=True, slots=True)
class JointMove:
    """All joints go evenly to a target, and stop there."""

    target: int  #: Number of the target, from 0: its joint positions.
    share: float  #: Of the fastest that the joints go, 0 to 1.
    speed: float  #: Of the tip, for languages that say the speed of joint motions by it [m/s].
    #: How long it takes, for languages that can say it and no share [s]; None for as long as the speeds make it.
    seconds: float | None = None
    turning: float = math.radians(500.0)  #: Angular velocity of the tip, beside `speed` [rad/s].


@dataclass(frozen=True, slots=True)
class StraightMove:
    """The tip goes in a straight line."""

    target: int  #: Number of the target, from 0: its pose.
    speed: float  #: Of the tip [m/s].
    zone: float = 0.0  #: How near the target the next move may begin [m]; 0 for a stop.


@dataclass(frozen=True, slots=True)
class CircleMove:
    """The tip goes along an arc through a target to another; as :class:`StraightMove` else."""

    #: start, via, target: numbers of the targets, from 0, where the arc begins, which it passes, and where it ends:
    #: their poses.
    start: int
    via: int
    target: int
    speed: float  #: speed, zone: of the tip [m/s], and how near the end the next move may begin [m].
    zone: float = 0.0


@dataclass(frozen=True, slots=True)
class Wait:
    """The robot stands still."""

    seconds: float  #: How long [s].


@dataclass(frozen=True, slots=True)
class Remark:
    """A comment in the program."""

    text: str  #: In ASCII, of :data:`LONGEST_COMMENT` characters at most.


@dataclass(frozen=True, slots=True)
class InputWait:
    """The robot stands still until a digital input was off and is on; where that takes too long, the program pauses.

    An input that is still on from the time before does not count.
    """

    input: str  #: Its number, or its name in languages that have names.
    seconds: float  #: How long it waits at most [s].
    label: str  #: What is waited for, for the message.


@dataclass(frozen=True, slots=True)
class Pause:
    """The program pauses until the operator starts it again."""

    label: str  #: Where it pauses, for the message.


@dataclass(frozen=True, slots=True)
class Carried:
    """What the controller is told of what is mounted on its flange, in the axes of that flange."""

    name: str  #: What the tip is called; empty for the flange.
    tip: tuple[float, float, float]  #: The point whose speed counts [m].
    mass: float  #: [kg].
    cog: tuple[float, float, float]  #: Centre of gravity [m].

    @property
    def tip_mm(self) -> tuple[str, ...]:
        """The tip in mm."""
        return tuple(number(1e3 * v, 3) for v in self.tip)

    @property
    def cog_mm(self) -> tuple[str, ...]:
        """The centre of gravity in mm."""
        return tuple(number(1e3 * v, 3) for v in self.cog)


ProgramStep = JointMove | StraightMove | CircleMove | Wait | Remark | InputWait | Pause


@dataclass(frozen=True, eq=False)
class MotionProgram(NewTargets):
    """Targets, and what the robot does one after the other."""

    notes: tuple[str, ...]  #: What a person should know who opens the program.
    steps: tuple[ProgramStep, ...]  #: In their order.
    #: What the controller is told to carry; None tells it nothing: moves are of the flange.
    carried: Carried | None = None

    @property
    def comments(self) -> tuple[str, ...]:
        """The notes, as every language may have them."""
        return tuple(ascii_only(note)[:LONGEST_COMMENT] for note in self.notes)

    def places(self) -> list[tuple[TargetKind, int]]:
        """Return which targets are used, and as what, in the order in which they are first gone to."""
        places: dict[tuple[TargetKind, int], None] = {}
        for step in self.steps:
            if isinstance(step, JointMove):
                places["joints", step.target] = None
            elif isinstance(step, CircleMove):
                places["pose", step.via] = None
                places["pose", step.target] = None
            elif isinstance(step, StraightMove):
                places["pose", step.target] = None
        return list(places)

    def zoned(self) -> Iterator[tuple[ProgramStep, float]]:
        """Yield every step with its zone [m]; 0 before a wait, a joint motion and the end, where the robot stops."""
        ahead = [step for step in self.steps if not isinstance(step, Remark)][1:]
        following = iter([*ahead, None])
        for step in self.steps:
            if isinstance(step, Remark):
                yield step, 0.0
                continue
            goes_on = isinstance(next(following), StraightMove | CircleMove)
            own = step.zone if isinstance(step, StraightMove | CircleMove) else 0.0
            yield step, own if goes_on else 0.0


def number(value: float, decimals: int) -> str:
    """Return a number with so many decimals at most, without zeros at its end."""
    text = written(value, decimals)
    return text.rstrip("0").rstrip(".") if "." in text else text


def percent(share: float) -> int:
    """Return a share in whole percent, rounded down, 1 at least."""
    return max(1, math.floor(100.0 * share + 1e-6))
