"""Jobs with the hexapod device: its poses, plans, cups from lengths, their uncertainty, and the base fixture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from truearm.engine.base.errors import InputError, Notice, counted, refusals_of, wrong_kind
from truearm.engine.base.files import path_argument
from truearm.engine.base.units import Marked
from truearm.engine.base.writing import output_file, same_place, write_files, write_text
from truearm.engine.command.arguments import (
    array_argument,
    count_argument,
    file_for,
    files_of,
    flag_argument,
    joints_argument,
    length_argument,
    lengths_argument,
    name_argument,
    robot_argument,
    whole_argument,
)
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.hexapod import (
    DEVICE,
    Design,
    Device,
    HexapodPose,
    assemblies,
    designs,
    distinct,
    near_equal,
    poses,
    side_names,
    tool_cups,
    triangle,
)
from truearm.engine.data.hexapod import distinct as distinct_poses
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.data.readers.rows import QUATERNION_TOLERANCE, unit_quaternions
from truearm.engine.document.records import Record, joints_lines, notice_lines, notice_summaries
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import JointsOf
from truearm.engine.robot.inverse.branches import BRANCHES
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform
from truearm.engine.robot.urdf_writing import counting
from truearm.hexapod.places import CupUncertainty, WorldFrame, all_solutions, cup_monte_carlo, world_frame
from truearm.hexapod.reachable import ARM_RADIUS, Reachable, attached_anew, reachable_at_places, steps_text, with_cups
from truearm.hexapod.sheet import CUP_DEVIATION, Attachments, Sheet, legs_of_side, sheet_csv, together
from truearm.hexapod.sheet_reading import read_sheet, read_touches

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
        return [*text, *self._changer_lines(), *notice_lines(self.notices)]

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


def hexapod_enumerate() -> HexapodPoses:
    """Count designs, assemblies and poses of the device, and list the poses that teach much the same."""
    found = poses()
    return HexapodPoses(len(designs()), len(list(assemblies())), found, distinct(found), near_equal(found))


#: More attachments than anybody compares.
_MOST_ATTACHMENTS: Final = 50


def hexapod_plan(
    robot: Robot | str | Path,
    fixture: Transform | Sequence[float] | Sequence[Transform | Sequence[float]],
    *,
    out: str | Path | None = None,
    steps: str | Path | None = None,
    tool: str | None = None,
    distinct: bool = False,
    branches: Sequence[str] = (),
    fourth_cup: bool = False,
    attachments: int = 1,
    arm_radius: float = ARM_RADIUS,
    joints: JointsOf | None = None,
) -> HexapodPlan:
    """Plan which configurations of a robot can be measured with the base fixture at one place or several.

    Parameters
    ----------
    robot
        A robot, or what :func:`truearm.load_robot` takes, with six joints that are solved in closed form.
    fixture
        The base fixture in the robot's base frame: a transform; x, y, z of B1 [m] and a turn about z [rad]; or x, y, z
        [m] and a quaternion w, x, y, z. Several of them are places where it stands one after the other.
    out
        CSV file for the sheet to fill in; None writes nothing.
    steps
        Text file for the same step by step, to print.
    tool
        Name of a tool of the robot file, with the three cups as its targets; its first if None.
    distinct
        Leave out near-equal poses.
    branches
        Only branches whose names begin so, such as ``front-up``; all of them if empty.
    fourth_cup
        Plan for a fourth cup below the three others, and poses on all four sides.
    attachments
        How often the tool is attached. After each time but the first, five configurations of the last place are
        measured again, which tells how well the tool changer repeats the cups.
    arm_radius
        Of the arm's links, for the room at the bars [m].
    joints
        Whose joint positions the files hold: the ``model``'s, or as the ``controller`` shows them; None for the
        controller's where the robot file says that they differ.

    Raises
    ------
    InputError
        If the robot has no such tool or no closed form, or can reach none of the poses with the fixture at a place.
    """
    places = _places_argument(fixture)
    wanted_branches = _branches_argument(branches)
    radius = length_argument(arm_radius, "arm_radius", 0.0)
    four_cups = flag_argument(fourth_cup, "fourth_cup")
    times = whole_argument(attachments, "attachments", 1, _MOST_ATTACHMENTS)
    only_distinct = flag_argument(distinct, "distinct")
    sheet = None if out is None else file_for(out, robot)
    text = None if steps is None else file_for(steps, robot, parameter="steps")
    if sheet is not None and text is not None and same_place(sheet, text):
        raise InputError("the sheet and the steps must be different files", parameter="steps", came=str(text))
    name = None if tool is None else name_argument(tool, "tool")
    loaded = robot_argument(robot)
    joints_are = joints_argument(joints, loaded)
    with refusals_of("tool"):
        arm, cups = with_cups(loaded, name)
        wanted = poses(cups)
    with refusals_of("robot"):
        found = reachable_at_places(
            arm,
            places,
            distinct_poses(wanted) if only_distinct else wanted,
            arm_radius=radius,
            branches=wanted_branches,
            fourth_cup=four_cups,
        )
    plan = HexapodPlan(arm, attached_anew(found, times), joints_are)
    files = {sheet: plan.sheet_text(), text: plan.steps_text()}
    written = {file.absolute(): content for file, content in files.items() if file is not None}
    if written:
        write_files(next(iter(written)).parent, {str(file): content for file, content in written.items()})
    return plan


def _places_argument(fixture: object) -> tuple[Transform, ...]:
    places = list(fixture) if isinstance(fixture, np.ndarray) and fixture.ndim == 2 else fixture
    if isinstance(places, list | tuple) and places and all(_is_place(one) for one in places):
        return tuple(_fixture_argument(one) for one in places)
    return (_fixture_argument(fixture),)


def _is_place(one: object) -> bool:
    return isinstance(one, Transform | np.ndarray | list | tuple)


def _fixture_argument(fixture: object) -> Transform:
    if isinstance(fixture, Transform):
        _fixture_argument([*fixture.translation, *fixture.quaternion])
        return fixture
    allowed = "x, y, z and a turn about z, or x, y, z and a quaternion w, x, y, z"
    numbers = array_argument(fixture, "fixture", ("n",), allowed).tolist()
    if len(numbers) not in (4, 7):
        raise InputError("the fixture has 4 or 7 numbers", parameter="fixture", came=len(numbers), allowed=allowed)
    x, y, z = lengths_argument(numbers[:3], "fixture", 3)
    if len(numbers) == 4:
        half = numbers[3] / 2
        return Transform((x, y, z), (math.cos(half), 0.0, 0.0, math.sin(half)))
    length = math.sqrt(sum(part * part for part in numbers[3:]))
    if abs(length - 1.0) > QUATERNION_TOLERANCE:
        raise InputError(
            "the quaternion (w, x, y, z) does not have length 1",
            parameter="fixture",
            came=f"length {length:.6g}",
            allowed=f"1 within {QUATERNION_TOLERANCE:g}",
            cure="Check the order of its numbers, and that all digits are there.",
        )
    w, i, j, k = unit_quaternions(np.array([numbers[3:]]), "fixture", [1])[0].tolist()
    return Transform((x, y, z), (w, i, j, k))


def _branches_argument(branches: object) -> tuple[str, ...]:
    if isinstance(branches, str) or not isinstance(branches, Sequence):
        raise wrong_kind("a sequence of names belongs here", branches, "branches", ", ".join(BRANCHES))
    return tuple(name_argument(name, "branches") for name in branches)


def hexapod_solve(
    sheet: Sheet | str | Path | Sequence[Sheet | str | Path] | None = None,
    *,
    pose: int | None = None,
    legs: Sequence[float] | None = None,
    base: Sequence[float] = (DEVICE.base,) * 3,
    tool: Sequence[float] = (DEVICE.tool,) * 3,
    reach: float = DEVICE.reach,
    out: str | Path | None = None,
) -> HexapodSolution:
    """Find the tool's cups from measured lengths, in the frame of the base fixture.

    Parameters
    ----------
    sheet
        A sheet that ``truearm.hexapod_plan`` wrote, filled in; or several, of one robot with one tool.
    pose, legs
        Instead of a sheet: which of the 72 poses, and its six lengths [m] in the order of the pose's legs.
    base, tool
        With `pose`: the distances B1-B2, B2-B3, B3-B1 and T1-T2, T2-T3, T3-T1 [m].
    reach
        How far a length may be from its nominal one to be measured [m].
    out
        CSV file for the cups of a sheet as measurements, for ``truearm.calibrate``; None writes nothing.

    Raises
    ------
    InputError
        If neither a sheet nor a pose is given, or both; if a length is beyond the ballbar's range, or legs do not meet;
        if sheets are not of one robot and tool, or a fixture did not stand still.
    """
    device = replace(DEVICE, reach=length_argument(reach, "reach", 0.0))
    if (sheet is None) == (legs is None) or (legs is None) != (pose is None):
        raise InputError(
            "a sheet, or a pose and its six legs, belong here",
            parameter="sheet, pose, legs",
            allowed="a sheet, or `pose` and `legs`",
        )
    if legs is not None:
        if out is not None:
            raise InputError(
                "one pose without joint positions is no data file",
                parameter="out",
                cure="Use a sheet, or leave it out.",
            )
        return HexapodSolution((_one_pose(pose, legs, base, tool, device),), (), None)
    given = _sheets_argument(sheet)
    inputs = files_of(*given)
    path = None if out is None else file_for(out, *inputs)
    with refusals_of("sheet"):
        whole = together(
            [one if isinstance(one, Sheet) else read_sheet(path_argument(one, "sheet"), device) for one in given]
        )
    measured, cups = whole.measured.tolist(), whole.cups()
    with_data = whole.configurations is not None and bool(measured)
    with refusals_of("sheet"):
        data = whole.dataset() if with_data or path is not None else None
    found = HexapodSolution(
        tuple(
            SolvedPose(
                whole.labels[row],
                whole.designs[row],
                whole.solutions[row],
                cups[row],
                place=whole.places[row] if whole.places else "",
                side=whole.sides[row],
            )
            for row in measured
        ),
        tuple(label for row, label in enumerate(whole.labels) if row not in measured),
        data,
        inputs,
        whole.attached(),
    )
    if path is not None:
        found.save(path)
    return found


def _sheets_argument(sheet: object) -> tuple[object, ...]:
    if isinstance(sheet, Sheet | str | Path) or not isinstance(sheet, Sequence):
        return (sheet,)
    if not sheet:
        raise InputError("there is no sheet", parameter="sheet", allowed="one or more")
    files = [one.absolute() for one in files_of(*sheet)]
    twice = [file for number, file in enumerate(files) if any(same_place(file, other) for other in files[:number])]
    if twice:
        raise InputError("the sheet is given twice", parameter="sheet", came=str(twice[0]), cure="Give it once.")
    return tuple(sheet)


def _one_pose(
    pose: object, legs: Sequence[float], base: Sequence[float], tool: Sequence[float], device: Device
) -> SolvedPose:
    known = poses()
    chosen = known[whole_argument(pose, "pose", 1, len(known)) - 1]
    lengths = np.array(lengths_argument(legs, "legs", 6))
    sides = {name: lengths_argument(given, name, 3) for name, given in (("base", base), ("tool", tool))}
    for names, values, nominal, parameter in (
        (chosen.design.leg_names, lengths.tolist(), device.leg, "legs"),
        (side_names("B"), sides["base"], device.base, "base"),
        (side_names("T"), sides["tool"], device.tool, "tool"),
    ):
        with refusals_of(parameter):
            for name, value in zip(names, values, strict=True):
                device.check(nominal, value, name, None)
    with refusals_of("base"):
        triangle(sides["base"], "B")
    with refusals_of("legs"):
        cups = tool_cups(chosen.design, chosen.solution, sides["base"], sides["tool"], lengths)
    return SolvedPose("", chosen.design, chosen.solution, cups)


def hexapod_uncertainty(*, trials: int = 100_000, seed: int = 0) -> HexapodUncertainty:
    """Say how well the tool's cups are known, in standard deviations of one length (Nubiola, Table 3.1).

    Parameters
    ----------
    trials, seed
        Of the Monte Carlo; 2 trials or more.

    Raises
    ------
    InputError
        If one of them is no such number.
    """
    trials, rng = count_argument(trials, "trials", 2), np.random.default_rng(whole_argument(seed, "seed"))
    solutions = all_solutions()
    drawn = tuple(cup_monte_carlo(number, trials, rng) for number in solutions)
    return HexapodUncertainty(tuple(solutions.values()), drawn)


def hexapod_world_frame(
    robot: Robot | str | Path,
    touches: ArrayLike | str | Path,
    base: Sequence[float],
    *,
    target: str | None = None,
    tool: str | None = None,
    reach: float = DEVICE.reach,
) -> HexapodFrame:
    """Find the base fixture from the joint positions at its cups and the distances between them.

    Parameters
    ----------
    robot
        A robot, or what :func:`truearm.load_robot` takes.
    touches
        Joint positions at B1, B2 and B3 [rad or m], ``(3, joints)``, or a CSV file of them.
    base
        Measured distances B1-B2, B2-B3, B3-B1 [m].
    target
        The cup of the tool that touched; the first if None.
    tool
        Name of a tool of the robot file, with the three cups as its targets; its first if None.
    reach
        How far a distance may be from its nominal one to be measured [m].

    Raises
    ------
    InputError
        If the robot has no such tool or target, or a distance is beyond the ballbar's range or of no triangle.
    """
    device = replace(DEVICE, reach=length_argument(reach, "reach", 0.0))
    sides = np.array(lengths_argument(base, "base", 3))
    with refusals_of("base"):
        for name, side in zip(side_names("B"), sides.tolist(), strict=True):
            device.check(device.base, side, name, None)
    cup = None if target is None else name_argument(target, "target")
    fixture = None if tool is None else name_argument(tool, "tool")
    loaded = robot_argument(robot)
    with refusals_of("tool"):
        arm, _ = with_cups(loaded, fixture)
    joints = _touches_argument(touches, arm)
    with refusals_of("target"):
        position, _ = arm.world_poses(joints, arm.targets[0].name if cup is None else cup)
    stand = arm.base
    points = (position - np.array(stand.translation)) @ stand.rotation
    with refusals_of("touches"):
        return HexapodFrame(world_frame(points, sides), loaded.simulated_from)


def _touches_argument(touches: object, robot: Robot) -> Array:
    if isinstance(touches, str | Path):
        with refusals_of("touches"):
            return read_touches(path_argument(touches, "touches"), robot)
    allowed = f"joint positions at B1, B2 and B3, or a CSV file: shape (3, {len(robot.joints)})"
    return array_argument(touches, "touches", (3, len(robot.joints)), allowed)
