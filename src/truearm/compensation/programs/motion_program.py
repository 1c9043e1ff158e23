"""A new program with stops, waits, circles and speeds, for every robot language to write down.

Steps refer to targets by their number, so that a pose that is gone to thirty times stands in the program once where
the language allows it. Speeds of straight moves and circles are those of the tip; a joint motion has a share of the
joints' speed, or, in languages that say no share, a speed of the tip.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, Literal

from truearm.compensation.programs.new_targets import NewTargets, ascii_only
from truearm.compensation.programs.numbers import written

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
        found: dict[tuple[TargetKind, int], None] = {}
        for step in self.steps:
            if isinstance(step, JointMove):
                found["joints", step.target] = None
            elif isinstance(step, CircleMove):
                found["pose", step.via] = None
                found["pose", step.target] = None
            elif isinstance(step, StraightMove):
                found["pose", step.target] = None
        return list(found)

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
