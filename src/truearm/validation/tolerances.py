"""What joint errors use of their tolerances, or what tolerances may do at the flange."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from truearm.engine.base.errors import InputError, refusals_of
from truearm.engine.base.units import Marked
from truearm.engine.command.arguments import lengths_argument, robot_argument
from truearm.engine.document.document import Block, Table, each, say
from truearm.engine.document.records import Record
from truearm.engine.robot.chain import Array
from truearm.engine.robot.conversion import converted
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
    """What one joint's assembly uses of its tolerances."""

    delta: float  #: How far the axis is aside at the hole's depth: perpendicularity or parallelism [m].
    towards: float  #: To which side it leans, from x towards y of the joint's frame [rad].
    position: tuple[float, float, float]  #: Of the joint's frame beside its place, x, y and z [m].


def tolerance_of(
    ebeta: float, egamma: float, depth: float, position: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> Tolerance:
    """Return the tolerance that errors use: angles [rad], hole depth and position [m]."""
    right, up = math.tan(ebeta) / math.cos(egamma), -math.tan(egamma)
    return Tolerance(checked_depth(depth) * math.hypot(right, up), math.atan2(up, right), position)


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


def joint_tolerances(robot: Robot, depths: Sequence[float]) -> tuple[Tolerance, ...]:
    """Return what the joints of a robot with joint errors use of their tolerances; hole depths in m."""
    values = robot.values
    return tuple(
        tolerance_of(
            values[f"ebeta_{i}"],
            values[f"egamma_{i}"],
            depth,
            (values[f"ex_{i}"], values[f"ey_{i}"], values[f"ez_{i}"]),
        )
        for i, depth in enumerate(depths, 1)
    )


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


@dataclass(frozen=True, eq=False, repr=False)
class UsedTolerances(Record):
    """What the errors of a robot's joints use of their tolerances."""

    robot: str  #: Its name.
    depths: tuple[float, ...]  #: Of the joints' holes [m].
    joints: tuple[Tolerance, ...]  #: What each joint uses.
    simulated_from: tuple[Marked, ...] = ()  #: What of it comes from a virtual instrument.

    def blocks(self) -> Iterator[Block]:
        """Give what each joint uses, in mm and deg."""
        yield say(robot=self.robot)
        heading = ("joint", "depth [mm]", "lean [mm]", "towards [deg]", "position x, y, z [mm]")
        entries: list[dict[str, Any]] = [
            {
                "joint": number,
                "depth_mm": depth * 1e3,
                "lean_mm": used.delta * 1e3,
                "towards_deg": math.degrees(used.towards),
                "position_mm": [v * 1e3 for v in used.position],
            }
            for number, (depth, used) in enumerate(zip(self.depths, self.joints, strict=True), 1)
        ]
        rows = [
            (
                str(row["joint"]),
                *(
                    f"{row[key]:{form}}"
                    for key, form in (("depth_mm", ".1f"), ("lean_mm", ".4f"), ("towards_deg", ".1f"))
                ),
                ", ".join(f"{v:.4f}" for v in row["position_mm"]),
            )
            for row in entries
        ]
        yield Table(heading, rows, in_json={"joints": entries})


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


def judged(asked: JudgeTolerance) -> UsedTolerances | AllowedErrors:
    """Return what the robot's own errors use of their tolerances, or what tolerances allow."""
    robot = robot_argument(asked.robot)
    count = len(robot.joints)
    depths = tuple(checked_depth(d) for d in lengths_argument(asked.depth, "depth", count, one_for_all=True))
    if asked.lean is None and asked.position is None:
        with refusals_of("robot"):
            design(robot)  # refuses robots without joint errors
        return UsedTolerances(robot.name, depths, joint_tolerances(robot, depths), robot.simulated_from)
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
