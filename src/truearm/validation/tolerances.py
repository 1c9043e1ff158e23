"""What joint errors use of their tolerances, or what tolerances may do at the flange."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Final

import numpy as np

from truearm.engine.base.errors import InputError, refusals_of
from truearm.engine.base.units import Marked
from truearm.engine.command.arguments import lengths_argument, robot_argument
from truearm.engine.document.document import Block, Table, each, say
from truearm.engine.document.records import Record
from truearm.engine.fit.problem import in_words
from truearm.engine.robot.chain import Array
from truearm.engine.robot.conversion import converted
from truearm.engine.robot.parameters import FreeParameters
from truearm.engine.robot.robot import Robot
from truearm.validation.lines import CONVENTION, design

if TYPE_CHECKING:
    from truearm.validation.jobs import JudgeTolerance


# Source: KR5 paper, sections 2.3 and 4.3. A hole of depth l whose far end may lie delta aside of its place lets the
# axis lean by ``atan(delta / l)`` (equation 8): perpendicularity if the axis is square to its datum, parallelism if it
# goes along it. Towards mu, from x to y, it leans by ``egamma = -atan(delta sin(mu) / l)`` and ``ebeta = atan(delta
# cos(mu) cos(egamma) / l)`` (9 and 10, which print them for ``Ry Rx`` and without the sign; equation 5 has ``Rx Ry``).
@dataclass(frozen=True)
class Tolerance:
    """What the leaning of one joint's axis uses of its tolerance."""

    delta: float  #: How far the axis is aside at the hole's depth: perpendicularity or parallelism [m].
    towards: float  #: To which side it leans, from x towards y of the joint's frame [rad].


def tolerance_of(ebeta: float, egamma: float, depth: float) -> Tolerance:
    """Return the tolerance that errors use: angles [rad] and hole depth [m]."""
    right, up = math.tan(ebeta) / math.cos(egamma), -math.tan(egamma)
    return Tolerance(checked_depth(depth) * math.hypot(right, up), math.atan2(up, right))


def errors_of_tolerance(delta: float, towards: float, depth: float) -> tuple[float, float]:
    """Return ebeta and egamma [rad] of an axis that is `delta` aside at a hole's depth [m], towards an angle [rad]."""
    share = delta / checked_depth(depth)
    egamma = -math.atan(share * math.sin(towards))
    return math.atan(share * math.cos(towards) * math.cos(egamma)), egamma


def checked_depth(depth: float) -> float:
    """Return a hole's depth [m], or refuse one that is none."""
    if not depth > 0.0:
        raise InputError("a hole needs a depth", parameter="depth", came=f"{depth * 1e3:g} mm", allowed="above 0 mm")
    return depth


@dataclass(frozen=True)
class KnownError:
    """A joint error, or a sum of errors that measurements could not tell apart, as a robot file knows it."""

    words: str  #: What it is: ``ey_2 + ez_1``.
    joints: tuple[int, ...]  #: Numbers of the joints whose errors are in it, from 1.
    value: float | None  #: None where it is unknown [m or rad].
    deviation: float | None  #: Standard deviation; None where none is stated [m or rad].

    def within(self, half: float) -> tuple[float, float] | None:
        """Return the ends that are so many deviations away [m or rad]; None where they are not known."""
        if self.value is None or self.deviation is None:
            return None
        return self.value - half * self.deviation, self.value + half * self.deviation

    @property
    def summary(self) -> dict[str, Any]:
        """It as JSON holds it, of a length."""
        at = None if self.value is None else self.value * 1e3
        return {
            "is": self.words,
            "joints": [*self.joints],
            "mm": at,
            "90_mm": _times(self.within(_NORMAL_90), 1e3),
        }


def known_errors(robot: Robot) -> dict[str, KnownError]:
    """Return the joint errors of a robot by their parameters, each with those that are in its value as well.

    Where some have deviations, those without were held in the identification. They are unknown, and what is identified
    is a sum that contains them.

    Raises:
        InputError: If the robot is not described by joint errors, or has none.
    """
    design(robot)
    errors = {name: p for name, p in robot.parameters.items() if p.group == "geometry"}
    kinds = ("base", "joint zero", "geometry")
    found = [name for name, p in robot.parameters.items() if p.deviation is not None and p.group in kinds]
    if not found and not any(p.value for p in errors.values()):
        raise InputError(
            "the robot file has no joint errors: all of them are zero, and none has a deviation",
            where=robot.name,
            cure="Find them with 'truearm axes', which writes joint-errors.yaml.",
        )
    held = [name for name, p in errors.items() if p.deviation is None] if found else []
    sums = _sums(robot, found, held)
    everything = FreeParameters(tuple(robot.parameters.values()))
    known = {}
    for name, p in errors.items():
        members = {name: 1.0, **sums.get(name, {})}
        value = sum(factor * errors[member].value for member, factor in members.items())
        words = in_words(members, everything, summed=True)
        joints = tuple(sorted({int(number) for number in re.findall(r"_(\d+)", words)}))
        known[name] = KnownError(words, joints, None if name in held else value, p.deviation)
    return known


def _sums(robot: Robot, found: Sequence[str], held: Sequence[str]) -> dict[str, dict[str, float]]:
    """Return which held errors are in the value of each identified parameter, with their factors [SI].

    What a held error does to the flange, in every configuration, the identified ones do in its place; the base helps
    where these alone cannot. One that nothing does in its place was not seen.
    """
    base = [name for name, p in robot.parameters.items() if p.group == "base"]
    q = robot.random_configurations(_FOR_SUMS, np.random.default_rng(0))
    linear, angular = robot.jacobians(robot.forward_kinematics(q), q, [*found, *base, *held])
    columns = np.concatenate([linear, angular], axis=1).reshape(len(linear), -1).T
    sums: dict[str, dict[str, float]] = {}
    for name, moved in zip(held, columns.T[len(found) + len(base) :], strict=True):
        for others in (columns[:, : len(found)], columns[:, : len(found) + len(base)]):
            factors = np.linalg.lstsq(others, moved, rcond=None)[0]
            if np.linalg.norm(others @ factors - moved) < _IN_ITS_PLACE * np.linalg.norm(moved):
                for other, factor in zip(found, factors.tolist(), strict=False):
                    if abs(factor) > _IN_ITS_PLACE:
                        sums.setdefault(other, {})[name] = factor
                break
    return sums


@dataclass(frozen=True, eq=False)
class FlangeError:
    """What the tolerances of the joints may do at the flange, over many configurations."""

    leaning: Array  #: Largest position error that each joint's leaning alone may cause [m], ``(joints,)``.
    #: The same of each joint's position tolerance, which moves all that is beyond alike [m], ``(joints,)``.
    position: Array
    #: If all of them come together at the worst, and in the mean of squares: at the worst configuration [m].
    together: tuple[float, float]


def flange_error(robot: Robot, leans: Sequence[float], positions: Sequence[float], q: Array) -> FlangeError:
    """Return the largest error of the flange's position that tolerances allow, each to its worst side.

    Args:
        robot: With joint errors, at those values around which they vary.
        leans: Largest angle of each joint's axis [rad].
        positions: Radius of the sphere in which each joint's frame may lie [m].
        q: Configurations to look at ``(n, joints)`` [rad].
    """
    count = len(robot.joints)
    names = [f"{angle}_{i}" for i in range(1, count + 1) for angle in ("ebeta", "egamma")]
    kinematics = robot.forward_kinematics(q)
    moved = robot.position_jacobian(kinematics, q, names).reshape(count, 2, 3, len(q))  # [m per rad]
    worst = np.linalg.norm(moved.transpose(0, 3, 2, 1), ord=2, axis=(2, 3))  # over all sides: (joints, n)
    leaning = worst * np.array(leans)[:, None]
    shifts = np.array(positions)
    return FlangeError(
        leaning.max(axis=1),
        shifts,
        (
            float((leaning.sum(axis=0) + shifts.sum()).max()),
            float(np.sqrt((leaning**2).sum(axis=0) + (shifts**2).sum()).max()),
        ),
    )


@dataclass(frozen=True)
class UsedLean:
    """What the leaning of one joint's axis uses of its tolerance, as far as its two angles are known."""

    depth: float  #: Of the joint's hole [m].
    angles: tuple[KnownError, KnownError]  #: ebeta and egamma.

    @property
    def used(self) -> Tolerance | None:
        """The tolerance used; None where an angle is unknown."""
        ebeta, egamma = (angle.value for angle in self.angles)
        return None if ebeta is None or egamma is None else tolerance_of(ebeta, egamma, self.depth)

    @property
    def intervals(self) -> tuple[tuple[float, float] | None, tuple[float, float] | None]:
        """Where delta [m] and its side [rad] lie with 90 % or more; None where that is not known, or any side may be.

        Both angles lie within their intervals of 95 % in 90 % of the cases or more, however they are correlated
        (Bonferroni).
        """
        ebeta, egamma = (angle.within(_NORMAL_95) for angle in self.angles)
        if self.used is None or ebeta is None or egamma is None:
            return None, None
        (b, b2), (g, g2) = ebeta, egamma
        least = tolerance_of(max(b, -b2, 0.0), max(g, -g2, 0.0), self.depth).delta
        largest = tolerance_of(max(-b, b2), max(-g, g2), self.depth).delta
        if least == 0.0:
            return (0.0, largest), None
        middle = self.used.towards
        corners = [tolerance_of(x, y, self.depth).towards for x in ebeta for y in egamma]
        turned = [math.remainder(corner - middle, math.tau) for corner in corners]
        return (least, largest), (middle + min(turned), middle + max(turned))

    @property
    def summary(self) -> dict[str, Any]:
        """It as JSON holds it."""
        used, (delta, side) = self.used, self.intervals
        return {
            "is": ", ".join(angle.words for angle in self.angles),
            "joints": sorted({joint for angle in self.angles for joint in angle.joints}),
            "depth_mm": self.depth * 1e3,
            "lean_mm": None if used is None else used.delta * 1e3,
            "lean_90_mm": _times(delta, 1e3),
            "towards_deg": None if used is None else math.degrees(used.towards),
            "towards_90_deg": _times(side, math.degrees(1.0)),
        }


@dataclass(frozen=True, eq=False, repr=False)
class UsedTolerances(Record):
    """What the errors of a robot's joints use of their tolerances."""

    is_list: ClassVar = True
    robot: str  #: Its name.
    leans: tuple[UsedLean, ...]  #: Of the axis of each joint.
    places: tuple[KnownError, ...]  #: ex, ey and ez of each joint [m].
    simulated_from: tuple[Marked, ...] = ()  #: What of it comes from a virtual instrument.

    def blocks(self) -> Iterator[Block]:
        """Give how far each axis leans, and where each joint is beside its place, in mm and deg."""
        yield say(robot=self.robot)
        leans, places = [lean.summary for lean in self.leans], [place.summary for place in self.places]
        heading = ("lean", "joints", "depth [mm]", "[mm]", "90 %", "towards [deg]", "90 %")
        shown = [
            (
                *_named(row),
                f"{row['depth_mm']:.1f}",
                *_shown(row["lean_mm"], row["lean_90_mm"], ".4f"),
                *_shown(row["towards_deg"], row["towards_90_deg"], ".1f", "any" if row["lean_90_mm"] else _NOT_KNOWN),
            )
            for row in leans
        ]
        yield Table(heading, shown, in_json={"leans": leans})
        rows = [(*_named(row), *_shown(row["mm"], row["90_mm"], ".4f")) for row in places]
        yield Table(("position", "joints", "[mm]", "90 %"), rows, in_json={"positions": places})
        known = [*self.places, *(angle for lean in self.leans for angle in lean.angles)]
        for is_so, words in (
            (any(" " in e.words for e in known), "Of a sum it is not known which of its errors has how much of it."),
            (any(e.value is None for e in known), "Unknown: measurements did not see it, or only in a sum."),
            (all(e.deviation is None for e in known), "The robot file states no deviations: intervals are not known."),
        ):
            yield say(words if is_so else "")


#: What is printed for an interval where no deviation is stated.
_NOT_KNOWN: Final = "not known"


def _times(ends: tuple[float, float] | None, scale: float) -> list[float] | None:
    return None if ends is None else [end * scale for end in ends]


def _named(row: dict[str, Any]) -> tuple[str, str]:
    return row["is"], ", ".join(map(str, row["joints"]))


def _shown(value: float | None, ends: list[float] | None, form: str, without: str = _NOT_KNOWN) -> tuple[str, str]:
    """Return a figure and its interval as cells."""
    if value is None:
        return "unknown", ""
    return f"{value:{form}}", without if ends is None else f"{ends[0]:{form}} to {ends[1]:{form}}"


@dataclass(frozen=True, eq=False, repr=False)
class AllowedErrors(Record):
    """The largest error of the flange's position that tolerances allow."""

    robot: str  #: Its name.
    configurations: int  #: How many were looked at.
    angles: tuple[float, ...]  #: Largest angle of each joint's axis [rad].
    errors: FlangeError  #: What the tolerances may do at the flange [m].
    simulated_from: tuple[Marked, ...] = ()  #: What of it comes from a virtual instrument.

    def blocks(self) -> Iterator[Block]:
        """Give what each joint may do, and all together, in mm and deg."""
        yield say(
            f"Largest error of the flange's position over {self.configurations} configurations:",
            robot=self.robot,
            configurations=self.configurations,
        )
        of_joints = zip(self.angles, self.errors.leaning.tolist(), self.errors.position.tolist(), strict=True)
        yield each(
            "joints",
            (
                say(
                    f"  joint {i}: {lean * 1e3:.4f} mm by leaning {math.degrees(angle):.4f} deg, "
                    f"{place * 1e3:.4f} mm by place",
                    joint=i,
                    angle_deg=math.degrees(angle),
                    by_lean_mm=lean * 1e3,
                    by_position_mm=place * 1e3,
                )
                for i, (angle, lean, place) in enumerate(of_joints, 1)
            ),
        )
        worst, root = (error * 1e3 for error in self.errors.together)
        yield say(
            f"  all at their worst {worst:.3f} mm, root of the sum of squares {root:.3f} mm",
            together={"worst_mm": worst, "root_of_squares_mm": root},
        )


#: Configurations at which the flange is looked at, drawn from the robot's limits.
_CONFIGURATIONS: Final = 2000
#: The same where errors are looked for that do what others do, which must do so in all of them.
_FOR_SUMS: Final = 40
#: By less than this share two motions of the flange are the same.
_IN_ITS_PLACE: Final = 1e-6
#: Deviations to both sides that hold a normal value in 90 and in 95 of 100 cases.
_NORMAL_90: Final = 1.644854
_NORMAL_95: Final = 1.959964


def judged(asked: JudgeTolerance) -> UsedTolerances | AllowedErrors:
    """Return what the robot's own errors use of their tolerances, or what tolerances allow."""
    robot = robot_argument(asked.robot)
    count = len(robot.joints)
    depths = tuple(checked_depth(d) for d in lengths_argument(asked.depth, "depth", count, one_for_all=True))
    if asked.lean is None and asked.position is None:
        with refusals_of("robot"):
            known = known_errors(robot)
        return UsedTolerances(
            robot.name,
            tuple(UsedLean(d, (known[f"ebeta_{i}"], known[f"egamma_{i}"])) for i, d in enumerate(depths, 1)),
            tuple(known[f"{slide}_{i}"] for i in range(1, count + 1) for slide in ("ex", "ey", "ez")),
            robot.simulated_from,
        )
    leans = lengths_argument(0.0 if asked.lean is None else asked.lean, "lean", count, 0.0, one_for_all=True)
    positions = lengths_argument(
        0.0 if asked.position is None else asked.position, "position", count, 0.0, one_for_all=True
    )
    with refusals_of("robot"):
        errors = robot if robot.convention_name == CONVENTION else converted(robot, CONVENTION)
    q = robot.random_configurations(_CONFIGURATIONS, np.random.default_rng(0))
    angles = tuple(errors_of_tolerance(a, 0.0, d)[0] for a, d in zip(leans, depths, strict=True))
    error = flange_error(errors, angles, positions, q)
    return AllowedErrors(robot.name, len(q), angles, error, robot.simulated_from)
