"""What jobs with the hexapod device return: poses, plans, cups from lengths, their uncertainty, the base fixture."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from truearm.engine.base.errors import InputError, Notice, counted
from truearm.engine.base.units import Marked
from truearm.engine.base.writing import output_file, write_text
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.hexapod import DEVICE, Design, HexapodPose, side_names
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.document.records import Record, joints_lines, notice_lines, notice_summaries
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import JointsOf
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.urdf_writing import counting
from truearm.hexapod.places import CupUncertainty, WorldFrame
from truearm.hexapod.reachable import Reachable, steps_text
from truearm.hexapod.sheet import CUP_DEVIATION, Attachments, legs_of_side, sheet_csv

_CUPS: Final = ("t1", "t2", "t3")


@dataclass(frozen=True, eq=False, repr=False)
class HexapodPoses(Record):
    """Designs, assemblies and poses of the device."""

    designs: int  #: designs, assemblies: how many there are.
    assemblies: int
    poses: tuple[HexapodPose, ...]  #: Those that can be measured, by their number.
    distinct: tuple[HexapodPose, ...]  #: Those of them that are left without near-equal ones.
    near_equal: tuple[tuple[int, int], ...]  #: Numbers of poses that teach much the same, in pairs.

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        return {
            "designs": self.designs,
            "assemblies": self.assemblies,
            "poses": len(self.poses),
            "distinct": len(self.distinct),
            "near_equal": [list(pair) for pair in self.near_equal],
        }

    def lines(self) -> list[str]:
        """Return what the command prints."""
        return [
            f"{self.designs} designs, {self.assemblies} assemblies above the base",
            f"{len(self.poses)} poses with the flange beyond the tool's plane, {len(self.distinct)} distinct",
            f"Nearer than 30 deg and 50 mm: {', '.join(f'{a}-{b}' for a, b in self.near_equal)}",
        ]


@dataclass(frozen=True, eq=False, repr=False)
class HexapodUncertainty(Record):
    """How well the tool's cups are known, in standard deviations of one length."""

    solutions: tuple[CupUncertainty, ...]  #: Propagated, for each of the four ways to assemble a design.
    drawn: tuple[tuple[float, float, float], ...]  #: The same by Monte Carlo: T1, T2, T3 of each solution.

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        return {
            "solutions": [
                {
                    **dict(zip(_CUPS, found.norms, strict=True)),
                    "t3_as_printed": float(np.linalg.norm(found.third_as_printed)),
                }
                for found in self.solutions
            ],
            "monte_carlo": [dict(zip(_CUPS, drawn, strict=True)) for drawn in self.drawn],
        }

    def lines(self) -> list[str]:
        """Return what the command prints."""
        said = self.summary()
        text = ["solution     t1     t2     t3   t3 as printed   Monte Carlo: t1     t2     t3   [sigma]"]
        for number, (row, again) in enumerate(zip(said["solutions"], said["monte_carlo"], strict=True), 1):
            figures = "  ".join(f"{row[name]:5.3f}" for name in _CUPS)
            checks = "  ".join(f"{again[name]:5.3f}" for name in _CUPS)
            text.append(f"{number:8}  {figures}  {row['t3_as_printed']:14.3f}  {checks:>32}")
        return text


@dataclass(frozen=True, eq=False)
class SolvedPose:
    """The tool's cups at one pose."""

    configuration: str  #: Its label; empty without a sheet.
    design: Design  #: design, solution: which legs were measured, and how they are assembled.
    solution: int
    cups: Array  #: T1, T2, T3 in the frame of the base fixture [m], ``(3, 3)``.
    place: str = ""  #: Name of the place of the base fixture; empty if the sheet has none.
    side: int = 1  #: On which side of four cups the legs were measured, 1 to 4.


@dataclass(frozen=True, eq=False, repr=False)
class HexapodSolution(Record):
    """The tool's cups, from lengths."""

    poses: tuple[SolvedPose, ...]  #: One for each configuration with six measured legs.
    left_out: tuple[str, ...]  #: Labels of the configurations of which a leg is missing.
    data: Dataset | None  #: The cups as measurements of the robot; None without joint positions.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.
    #: How well the tool changer repeats the cups; None if the tool was attached once, as far as is said.
    attached: Attachments | None = None
    out: Path | None = None  #: The canonical CSV file that holds the cups; None if none was written.

    @property
    def notices(self) -> tuple[Notice, ...]:
        """What to know about it."""
        if self.attached is None or self.attached.found is not None:
            return ()
        return (
            Notice(
                "attachments-not-compared",
                f"The tool was attached {self.attached.count} times, and no configuration was measured with two of "
                "the attachments: how well the tool changer repeats the cups is not known, and the data declare no "
                "standard deviations. Measure a few configurations again after the next attachment.",
            ),
        )

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it, in mm."""
        entries = [
            {
                "configuration": pose.configuration,
                "design": pose.design.name,
                "solution": pose.solution,
                "legs": list(legs_of_side(pose.design, pose.side)),
                "place": pose.place or None,
                "side": pose.side,
                "cups_mm": (pose.cups * 1e3).tolist(),
            }
            for pose in self.poses
        ]
        return {
            "poses": entries,
            "left_out": list(self.left_out),
            "tool_changer": self._changer(),
            "notices": notice_summaries(self.notices),
        }

    def _changer(self) -> dict[str, Any] | None:
        if self.attached is None or self.attached.found is None:
            return None
        found = self.attached.found
        return {
            "attachments": found.compared,
            "pairs": found.pairs,
            "deviation_mm": (found.changer * 1e3).tolist(),
            "rest_mm": None if found.rest is None else (found.rest * 1e3).tolist(),
            "mean_mm": (found.mean * 1e3).tolist(),
            "largest_mm": (found.largest * 1e3).tolist(),
            "ballbar_mm": CUP_DEVIATION * DEVICE.sigma * 1e3,
        }

    def lines(self) -> list[str]:
        """Return what the command prints."""
        text = []
        for pose in self.poses:
            at = [f"place {pose.place}"] if pose.place else []
            at += [f"side {pose.side}"] if any(other.side > 1 for other in self.poses) else []
            at += [f"design {pose.design.name}", f"solution {pose.solution}"]
            text.append(f"{pose.configuration or 'pose'}: {', '.join(at)}")
            for cup, (x, y, z) in enumerate((pose.cups * 1e3).tolist(), 1):
                text.append(f"  T{cup}  x {x:.4f}  y {y:.4f}  z {z:.4f} mm")
        if self.left_out:
            text.append(f"Left out, not all legs measured: {', '.join(self.left_out)}")
        written = [] if self.out is None else [f"Written to {self.out}"]
        return [*text, *self._changer_lines(), *notice_lines(self.notices), *written]

    def _changer_lines(self) -> list[str]:
        changer = self._changer()
        if changer is None:
            return []
        worst = max(changer["deviation_mm"])
        rest = "the robot's repeatability contained"
        if changer["rest_mm"] is not None:
            rest = "robot and ballbar without it {:.4f}, {:.4f}, {:.4f} mm".format(*changer["rest_mm"])
        return [
            f"Tool changer, from {counted(changer['pairs'], 'pair')} of readings with {changer['attachments']} "
            "attachments:",
            "  it repeats a coordinate of T1, T2, T3 to {:.4f}, {:.4f}, {:.4f} mm".format(*changer["deviation_mm"])
            + f" ({rest})",
            "  a cup is moved by {:.4f}, {:.4f}, {:.4f} mm on average,".format(*changer["mean_mm"])
            + " by {:.4f}, {:.4f}, {:.4f} mm at most".format(*changer["largest_mm"]),
            f"  the ballbar alone would know it to {changer['ballbar_mm']:.4f} mm: taking the tool off costs "
            f"{worst / changer['ballbar_mm']:.0f} times as much. The data declare it.",
        ]

    def save(self, file: str | Path) -> None:
        """Write the cups as a canonical CSV file, for ``truearm.calibrate``."""
        if self.data is None:
            raise InputError("there are no joint positions, so this is no data", parameter="file")
        write_text(output_file(file, self.inputs), csv_text(self.data))


@dataclass(frozen=True, eq=False, repr=False)
class HexapodPlan(Record):
    """Which configurations of a robot can be measured with the base fixture at one place or several."""

    robot: Robot  #: With the cups as its targets.
    reachable: Reachable  #: The configurations in their order, and what was left out.
    #: Whose joint positions the files hold: the ``model``'s, or those that the ``controller`` shows.
    joints_are: JointsOf = "model"
    files: tuple[Path, ...] = ()  #: Those that were written.

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it, in mm."""
        found = self.reachable
        return {
            "poses": found.poses,
            "poses_reached": found.poses_reached,
            "joints_are": self.joints_are,
            "configurations": len(found.rows),
            "places": self._places(),
            "left_out": dict(found.left_out),
            "smallest_room_mm": float(found.clearance.min()) * 1e3,
        }

    def lines(self) -> list[str]:
        """Return what the command prints."""
        said = self.summary()
        left_out = ", ".join(f"{n} {why}" for why, n in said["left_out"].items())
        return [
            f"{said['poses_reached']} of {said['poses']} poses, {said['configurations']} configurations",
            *self._place_lines(said["places"]),
            f"Left out: {left_out or 'nothing'}",
            f"Smallest room between arm and bars: {said['smallest_room_mm']:.0f} mm",
            *joints_lines(self.joints_are),
            *([f"Written to {', '.join(map(str, self.files))}"] if self.files else []),
        ]

    def _places(self) -> list[dict[str, Any]]:
        """Return how many configurations there are at each place, and on each side."""
        sides: dict[str, dict[str, int]] = {}
        for row in self.reachable.rows:
            of_place = sides.setdefault(row.place, {})
            of_place[str(row.side)] = of_place.get(str(row.side), 0) + 1
        return [{"place": name or None, "sides": dict(sorted(found.items()))} for name, found in sides.items()]

    def _place_lines(self, places: list[dict[str, Any]]) -> list[str]:
        with_sides = any(len(place["sides"]) > 1 for place in places)
        if len(places) == 1 and not with_sides:
            return []
        text = []
        for place in places:
            line = f"{place['place'] or 'The fixture'}: {counted(sum(place['sides'].values()), 'configuration')}"
            if with_sides:
                line += f" ({', '.join(f'{n} on side {side}' for side, n in place['sides'].items())})"
            text.append(line)
        return text

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

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it, in mm."""
        found = self.found
        return {
            "position_mm": [value * 1e3 for value in found.frame.translation],
            "quaternion": list(found.frame.quaternion),
            "plain": {
                "position_mm": [value * 1e3 for value in found.plain.translation],
                "quaternion": list(found.plain.quaternion),
            },
            "distances_by_robot_mm": (found.seen * 1e3).tolist(),
            "residuals_mm": (np.linalg.norm(found.residual, axis=1) * 1e3).tolist(),
        }

    def lines(self) -> list[str]:
        """Return what the command prints."""
        said = self.summary()
        x, y, z = said["position_mm"]
        seen = ", ".join(f"{n} {s:.3f}" for n, s in zip(side_names("B"), said["distances_by_robot_mm"], strict=True))
        return [
            f"Base fixture in the robot's base frame: x {x:.4f}  y {y:.4f}  z {z:.4f} mm",
            "  quaternion {:.8f} {:.8f} {:.8f} {:.8f}".format(*said["quaternion"]),
            f"Distances by the robot: {seen} mm",
            "Left at the cups: {:.4f}, {:.4f}, {:.4f} mm".format(*said["residuals_mm"]),
        ]
