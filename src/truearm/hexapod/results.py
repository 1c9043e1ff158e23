"""What jobs with the hexapod device return: poses, plans, cups from lengths, their uncertainty, the base fixture."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError, Notice, Rule, counted
from truearm.engine.base.units import Marked
from truearm.engine.base.writing import output_file, write_text
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.hexapod import DEVICE, Design, HexapodPose, side_names
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.document.document import Block, Words, detail, each, say, under
from truearm.engine.document.records import Record, joints_lines, notice_lines, notice_summaries
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import JointsOf
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.urdf_writing import counting
from truearm.hexapod.places import CupUncertainty, WorldFrame
from truearm.hexapod.reachable import Reachable, steps_text
from truearm.hexapod.sheet import CUP_DEVIATION, Attachments, ChangerRepeatability, legs_of_side, sheet_csv


@dataclass(frozen=True, eq=False, repr=False)
class HexapodPoses(Record):
    """Designs, assemblies and poses of the device."""

    designs: int  #: designs, assemblies: how many there are.
    assemblies: int
    poses: tuple[HexapodPose, ...]  #: Those that can be measured, by their number.
    distinct: tuple[HexapodPose, ...]  #: Those of them that are left without near-equal ones.
    near_equal: tuple[tuple[int, int], ...]  #: Numbers of poses that teach much the same, in pairs.

    def blocks(self) -> Iterator[Block]:
        """Give how many there are."""
        yield say(
            f"{self.designs} designs, {self.assemblies} assemblies above the base",
            f"{len(self.poses)} poses with the flange beyond the tool's plane, {len(self.distinct)} distinct",
            f"Nearer than 30 deg and 50 mm: {', '.join(f'{a}-{b}' for a, b in self.near_equal)}",
            designs=self.designs,
            assemblies=self.assemblies,
            poses=len(self.poses),
            distinct=len(self.distinct),
            near_equal=[list(pair) for pair in self.near_equal],
        )


@dataclass(frozen=True, eq=False, repr=False)
class HexapodUncertainty(Record):
    """How well the tool's cups are known: standard deviations in those of one length, and radii of 95 %."""

    solutions: tuple[CupUncertainty, ...]  #: Propagated, for each of the four ways to assemble a design.
    drawn: tuple[tuple[float, float, float], ...]  #: The same by Monte Carlo: T1, T2, T3 of each solution.

    def blocks(self) -> Iterator[Block]:
        """Give both for each solution."""
        printed = [float(np.linalg.norm(solution.third_as_printed)) for solution in self.solutions]
        norms = [solution.norms for solution in self.solutions]
        radii = [[DEVICE.sigma * 1e6 * radius for radius in solution.radii] for solution in self.solutions]
        yield say(
            "solution     t1     t2     t3   t3 as printed   Monte Carlo: t1     t2     t3   [sigma]   "
            "95 % within: t1     t2     t3   [um]",
            *(
                f"{number:8}  {_three(row)}  {third:14.3f}  {_three(again):>32}  {_three(around):>41}"
                for number, (row, third, again, around) in enumerate(
                    zip(norms, printed, self.drawn, radii, strict=True), 1
                )
            ),
            solutions=[
                _by_cup(row) | {"t3_as_printed": third, "radius_95_um": _by_cup(around)}
                for row, third, around in zip(norms, printed, radii, strict=True)
            ],
            monte_carlo=[_by_cup(drawn) for drawn in self.drawn],
        )


def _three(sigmas: Iterable[float]) -> str:
    return "  ".join(f"{sigma:5.3f}" for sigma in sigmas)


def _by_cup(sigmas: Iterable[float]) -> dict[str, float]:
    return dict(zip(("t1", "t2", "t3"), sigmas, strict=True))


@dataclass(frozen=True, eq=False)
class SolvedPose:
    """The tool's cups at one pose."""

    configuration: str  #: Its label; empty without a sheet.
    design: Design  #: design, solution: which legs were measured, and how they are assembled.
    solution: int
    cups: Array  #: T1, T2, T3 in the frame of the base fixture [m], ``(3, 3)``.
    place: str = ""  #: Name of the place of the base fixture; empty if the sheet has none.
    side: int = 1  #: On which side of four cups the legs were measured, 1 to 4.

    def block(self, *, among: Sequence[SolvedPose]) -> Words:
        """Return where the cups are, in mm; the side is said if others are measured on several."""
        at = [f"place {self.place}"] if self.place else []
        at += [f"side {self.side}"] if any(other.side > 1 for other in among) else []
        at += [f"design {self.design.name}", f"solution {self.solution}"]
        cups = (self.cups * 1e3).tolist()
        return (say if len(among) == 1 else detail)(
            f"{self.configuration or 'pose'}: {', '.join(at)}",
            *(f"  T{cup}  x {x:.4f}  y {y:.4f}  z {z:.4f} mm" for cup, (x, y, z) in enumerate(cups, 1)),
            configuration=self.configuration,
            design=self.design.name,
            solution=self.solution,
            legs=list(legs_of_side(self.design, self.side)),
            place=self.place or None,
            side=self.side,
            cups_mm=cups,
        )


ATTACHMENTS_NOT_COMPARED: Final = Rule(
    "attachments-not-compared",
    "warning",
    "no configuration was measured with two attachments, so the data declare no standard deviation",
    cure="Measure a few configurations again after the next attachment.",
)


@dataclass(frozen=True, eq=False, repr=False)
class HexapodSolution(Record):
    """The tool's cups, from lengths."""

    poses: tuple[SolvedPose, ...]  #: One for each configuration with six measured legs.
    left_out: tuple[str, ...]  #: Labels of the configurations of which a leg is missing.
    data: Dataset | None  #: The cups as measurements of the robot; None without joint positions.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.
    #: How well the tool changer repeats the cups; None if the tool was attached once, as far as is said.
    attached: Attachments | None = None

    @property
    def notices(self) -> tuple[Notice, ...]:
        """What to know about it."""
        if self.attached is None or self.attached.repeatability is not None:
            return ()
        return (
            ATTACHMENTS_NOT_COMPARED(
                f"The tool was attached {self.attached.count} times, and no configuration was measured with two of "
                "the attachments: how well the tool changer repeats the cups is not known, and the data declare no "
                "standard deviations."
            ),
        )

    def blocks(self) -> Iterator[Block]:
        """Give the cups of each pose, and how well the tool changer repeats them, in mm."""
        yield say(f"{counted(len(self.poses), 'pose')} solved." if len(self.poses) > 1 else "")
        yield each("poses", (pose.block(among=self.poses) for pose in self.poses))
        missing = [f"Left out, not all legs measured: {', '.join(self.left_out)}"] if self.left_out else []
        yield say(*missing, left_out=list(self.left_out))
        repeats = None if self.attached is None else self.attached.repeatability
        yield say(tool_changer=None) if repeats is None else under("tool_changer", [_changer(repeats)])
        yield say(*notice_lines(self.notices), notices=notice_summaries(self.notices))

    def written_at(self, out: str) -> str:
        """Return the line that says which file holds the cups."""
        return f"Written to {out}"

    def save(self, file: str | Path) -> None:
        """Write the cups as a canonical CSV file, for ``truearm.calibrate``."""
        if self.data is None:
            raise InputError("there are no joint positions, so this is no data", parameter="file")
        write_text(output_file(file, self.inputs), csv_text(self.data))


def _changer(repeatability: ChangerRepeatability) -> Words:
    """Return how well the tool changer repeats the cups, in mm."""
    deviation, mean, largest = (
        (values * 1e3).tolist() for values in (repeatability.changer, repeatability.mean, repeatability.largest)
    )
    robot = None if repeatability.rest is None else (repeatability.rest * 1e3).tolist()
    ballbar = CUP_DEVIATION * DEVICE.sigma * 1e3
    remark = "the robot's repeatability contained"
    if robot is not None:
        remark = f"robot and ballbar without it {_lengths(robot)} mm"
    return say(
        f"Tool changer, from {counted(repeatability.pairs, 'pair')} of readings with {repeatability.compared} "
        "attachments:",
        f"  it repeats a coordinate of T1, T2, T3 to {_lengths(deviation)} mm ({remark})",
        f"  a cup is moved by {_lengths(mean)} mm on average, by {_lengths(largest)} mm at most",
        f"  the ballbar alone would know it to {ballbar:.4f} mm: taking the tool off costs "
        f"{max(deviation) / ballbar:.0f} times as much. The data declare it.",
        attachments=repeatability.compared,
        pairs=repeatability.pairs,
        deviation_mm=deviation,
        rest_mm=robot,
        mean_mm=mean,
        largest_mm=largest,
        ballbar_mm=ballbar,
    )


def _lengths(values: Iterable[float]) -> str:
    return ", ".join(f"{value:.4f}" for value in values)


@dataclass(frozen=True, eq=False, repr=False)
class HexapodPlan(Record):
    """Which configurations of a robot can be measured with the base fixture at one place or several."""

    robot: Robot  #: With the cups as its targets.
    reachable: Reachable  #: The configurations in their order, and what was left out.
    #: Whose joint positions the files hold: the ``model``'s, or those that the ``controller`` shows.
    joints_are: JointsOf = "model"
    files: tuple[Path, ...] = ()  #: Those that were written.

    def blocks(self) -> Iterator[Block]:
        """Give how many configurations there are, at which places, and what was left out, in mm."""
        plan, gap = self.reachable, float(self.reachable.clearance.min()) * 1e3
        yield say(
            f"{plan.poses_reached} of {plan.poses} poses, {len(plan.rows)} configurations",
            poses=plan.poses,
            poses_reached=plan.poses_reached,
            configurations=len(plan.rows),
        )
        yield each("places", self._places())
        left_out = ", ".join(f"{n} {why}" for why, n in plan.left_out.items())
        yield say(f"Left out: {left_out or 'nothing'}", left_out=dict(plan.left_out))
        yield say(f"Smallest room between arm and bars: {gap:.0f} mm", smallest_room_mm=gap)
        yield say(*joints_lines(self.joints_are), joints_are=self.joints_are)
        if self.files:
            yield say(f"Written to {', '.join(map(str, self.files))}")

    def _places(self) -> Iterator[Words]:
        """Give how many configurations there are at each place, and on each side."""
        sides: dict[str, Counter[str]] = {}
        for row in self.reachable.rows:
            sides.setdefault(row.place, Counter())[str(row.side)] += 1
        several = any(len(counts) > 1 for counts in sides.values())
        for place, counts in sides.items():
            line = f"{place or 'The fixture'}: {counted(counts.total(), 'configuration')}"
            if several:
                line += f" ({', '.join(f'{n} on side {side}' for side, n in sorted(counts.items()))})"
            lines = [line] if several or len(sides) > 1 else []
            yield say(*lines, place=place or None, sides=dict(sorted(counts.items())))

    def sheet_text(self) -> str:
        """Return the sheet to fill in, as CSV."""
        return sheet_csv(self.reachable.rows, self.robot.joints, controller=counting(self.robot, self.joints_are))

    def steps_text(self) -> str:
        """Return the plan step by step, to print."""
        return steps_text(self.reachable, self.robot, counting(self.robot, self.joints_are))


@dataclass(frozen=True, eq=False, repr=False)
class HexapodFrame(Record):
    """Where the base fixture stands in the robot's base frame."""

    found: WorldFrame  #: The frame, what it would be without the measured distances, and what is left at the cups.
    simulated_from: tuple[Marked, ...] = ()  #: What of it comes from a virtual instrument.

    def blocks(self) -> Iterator[Block]:
        """Give the frame, the distances between its cups by the robot, and what is left at them, in mm."""
        world_frame = self.found
        x, y, z = position = [value * 1e3 for value in world_frame.frame.translation]
        yield say(
            f"Base fixture in the robot's base frame: x {x:.4f}  y {y:.4f}  z {z:.4f} mm",
            "  quaternion {:.8f} {:.8f} {:.8f} {:.8f}".format(*world_frame.frame.quaternion),
            position_mm=position,
            quaternion=list(world_frame.frame.quaternion),
            plain={
                "position_mm": [value * 1e3 for value in world_frame.plain.translation],
                "quaternion": list(world_frame.plain.quaternion),
            },
        )
        distances = (world_frame.seen * 1e3).tolist()
        seen = ", ".join(f"{name} {length:.3f}" for name, length in zip(side_names("B"), distances, strict=True))
        yield say(f"Distances by the robot: {seen} mm", distances_by_robot_mm=distances)
        left = (np.linalg.norm(world_frame.residual, axis=1) * 1e3).tolist()
        yield say(f"Left at the cups: {_lengths(left)} mm", residuals_mm=left)
