"""Poses of a named set: those of ISO 9283 in a cube, and those on a sphere."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from truearm.engine.base.errors import InputError, Notice, counted, degrees, listed, millimetres, refusals_of
from truearm.engine.base.limits import limit
from truearm.engine.base.writing import output_file, write_files
from truearm.engine.command.arguments import (
    choice_argument,
    command_argument,
    files_of,
    joints_argument,
    length_argument,
    lengths_argument,
    numbers_argument,
    python_call,
    robot_argument,
    whole_argument,
)
from truearm.engine.command.driving import tip_argument
from truearm.engine.data.controller_joints import in_controller_joints
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.data.readers.rows import QUATERNION_TOLERANCE
from truearm.engine.document.records import Record, joints_lines, notice_lines, notice_summaries
from truearm.engine.motion.cube import DOWN, PLANES, Cube
from truearm.engine.motion.largest_cube import DIRECTIONS, Direction, largest_cube
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import JointsOf
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import quaternion_from_rotation, rotation_from_quaternion
from truearm.planning.pose_sets import POSE_SETS, PoseSet, pose_set

#: What the page beside a set ends with.
PAGE: Final = ".html"
#: What is put behind the name of a set to name the file of its poses.
POSES: Final = "-poses.csv"


@dataclass(frozen=True, eq=False, repr=False)
class PlannedPoses(Record):
    """Poses of a named set."""

    robot: Robot  #: The robot that goes to them, with its targets.
    made: PoseSet  #: The poses.
    command: str  #: How to run it again.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.
    #: Whose joint positions the file holds: the ``model``'s, or those that the ``controller`` shows.
    joints_are: JointsOf = "model"
    own_target: bool = True  #: Whether the robot has the target that goes to the poses, so that ``ik`` finds it.

    @property
    def joints(self) -> Array:
        """Joint positions at the poses, of the model [rad; m for prismatic joints], ``(n, joints)``."""
        return self.made.joints

    @property
    def labels(self) -> tuple[str, ...]:
        """Name of each pose."""
        return self.made.labels

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What to know about the set."""
        missed = self.made.missed
        if not missed:
            return ()
        return (
            Notice(
                "unreachable-poses",
                f"{counted(len(missed), 'pose')} of the set {self.made.name} cannot be reached within the joint limits "
                f"and {'is' if len(missed) == 1 else 'are'} left out: {listed(missed)}. Take another centre, a smaller "
                "side, or another orientation.",
                "error",
            ),
        )

    def summary(self) -> dict[str, Any]:
        """Return the set as JSON holds it: lengths in mm."""
        made = self.made
        return {
            "set": made.name,
            "poses": len(made.labels),
            "target": made.target,
            **({} if made.cube is None else {"cube_mm": _cube(made)}),
            "joints_are": self.joints_are,
            "missed": list(made.missed),
            "warnings": notice_summaries(self.warnings),
        }

    @property
    def answer(self) -> list[str]:
        """What the set is, in words."""
        made = self.made
        first = f"{counted(len(made.labels), 'pose')} of the set {made.name}{self._where()}."
        return [first, *(self._moves() if made.name == "118" else ())]

    def lines(self) -> list[str]:
        """Return what the set is, and what cannot be reached."""
        return [*self.answer, *joints_lines(self.joints_are), *notice_lines(self.warnings)]

    def _moves(self) -> list[str]:
        """Return by how much every joint moves from one pose to the next."""
        moves = np.abs(np.diff(self.joints, axis=0)).min(axis=0, initial=np.inf)
        words = {"revolute": degrees, "prismatic": millimetres}
        units = {"revolute": "deg", "prismatic": "mm"}
        said = []
        for kind in words:
            of_kind = [move for move, joint in zip(moves, self.robot.joints, strict=True) if joint.kind == kind]
            if of_kind and np.isfinite(min(of_kind)):
                said.append(f"{words[kind](min(of_kind))} {units[kind]}")
        return [f"Every joint moves by {' or '.join(said)} or more from one pose to the next."] if said else []

    def dataset(self) -> Dataset:
        """Return the configurations as measurements whose readings are still missing, at the model's joints."""
        names = tuple(target.name for target in self.robot.targets)
        count = len(self.labels)
        return Dataset(
            source=f"set {self.made.name}",
            labels=self.labels,
            joints=self.joints,
            joint_kinds=tuple(joint.kind for joint in self.robot.joints),
            targets=names,
            configuration=np.repeat(np.arange(count), len(names)),
            target=np.tile(np.arange(len(names)), count),
            position=np.full((count * len(names), 3), np.nan),
        )

    def csv_text(self) -> str:
        """Return the configurations as a canonical CSV whose x, y and z are still empty."""
        data = self.dataset()
        return csv_text(in_controller_joints(self.robot, data) if self.joints_are == "controller" else data)

    def poses_text(self) -> str:
        """Return the poses as ``truearm ik`` reads them, in the robot's base frame.

        They are those of the target, or of the flange where none was named that the robot has itself.
        """
        position, rotation = self.made.position, self.made.rotation
        if not self.own_target:
            position, rotation = self.robot.forward(self.joints)
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["pose", "x [mm]", "y [mm]", "z [mm]", "qw", "qx", "qy", "qz"])
        turned = quaternion_from_rotation(rotation)
        for label, at, quaternion in zip(self.labels, position.tolist(), turned.tolist(), strict=True):
            writer.writerow([label, *(_shown(v * 1e3, 9) for v in at), *(_shown(v, 15) for v in quaternion)])
        return stream.getvalue()

    def page(self) -> str:
        """Return the page with the picture of the poses."""
        from truearm.planning.pose_set_page import pose_set_page

        return pose_set_page(self)

    def save(self, file: str | Path) -> tuple[Path, ...]:
        """Write the configurations as CSV, the poses beside them, and a page with the picture.

        Returns:
            The files written.
        """
        table, poses, page = self.places(file)
        contents = {table.name: self.csv_text(), poses.name: self.poses_text(), page.name: self.page()}
        write_files(table.parent, contents, self.command)
        return table, poses, page

    def places(self, file: str | Path) -> tuple[Path, Path, Path]:
        """Return where configurations, poses and page are written."""
        return places(file, self.inputs)

    def _where(self) -> str:
        cube = self.made.cube
        if cube is None:
            return ""
        centre = ", ".join(millimetres(value) for value in cube.centre)
        return f" in the cube of {millimetres(cube.side)} mm about ({centre}) mm"


def places(file: object, inputs: tuple[Path, ...], parameter: str = "file") -> tuple[Path, Path, Path]:
    """Return where configurations, poses and page are written; refuse a place that cannot be, or not ours."""
    table = output_file(file, inputs, parameter, ours=True)
    if table.suffix == PAGE:
        raise InputError("the set is a CSV file", parameter=parameter, came=table.name, allowed="SET.csv")
    poses = output_file(table.with_name(f"{table.stem}{POSES}"), inputs, parameter, ours=True)
    return table, poses, output_file(table.with_suffix(PAGE), inputs, parameter, ours=True)


def _cube(made: PoseSet) -> dict[str, Any]:
    assert made.cube is not None
    return {"centre": (made.cube.centre * 1e3).tolist(), "side": made.cube.side * 1e3}


def _shown(value: float, decimals: int) -> str:
    return repr(round(value, decimals) + 0.0)


def poses(
    robot: Robot | str | Path,
    set: str,
    *,
    centre: Sequence[float] | None = None,
    side: float | None = None,
    ahead: Direction = "+x",
    nearest: float = 0.0,
    floor: float = 0.0,
    plane: str = "C1-C2-C7-C8",
    count: int | None = None,
    target: str | None = None,
    tip: Sequence[float] | None = None,
    orientation: Literal["free", "down"] | Sequence[float] = "free",
    seed: int = 0,
    joints: JointsOf | None = None,
    out: str | Path | None = None,
    command: str | None = None,
) -> PlannedPoses:
    """Return the poses of a set, and the joint positions that reach them.

    Parameters
    ----------
    robot
        Nominal or calibrated, or what :func:`truearm.load_robot` takes.
    set
        ``p1-p5``, ``iso-cube``, ``diagonal``, ``118`` or ``sphere``.
    centre, side
        Of the cube in the robot's base frame [m]; None for the largest cube that the robot reaches. The sphere is
        about the centre, and its radius is half the side; it needs both.
    ahead
        Direction in which the largest cube is searched: ``+x``, ``-x``, ``+y`` or ``-y``.
    nearest, floor
        How far ahead of the base's origin, and how high above it, the largest cube begins [m].
    plane
        Which diagonal plane, for sets on one: ``C1-C2-C7-C8``, ``C2-C3-C8-C5``, ``C3-C4-C5-C6`` or ``C4-C1-C6-C7``.
    count
        How many poses, for ``diagonal``, ``118`` and ``sphere``; None for 25, 118 and 50.
    target
        Name of the target that goes to the poses; None for the flange, or `tip`.
    tip
        What goes to the poses, by its place in the flange frame [m].
    orientation
        ``free``, ``down`` (the tip's z axis against that of the base, its x axis along the base's), or a quaternion
        (w, x, y, z) of the tip in the base frame.
    seed
        Of the random configurations from which poses in any orientation are reached.
    joints
        Whose joint positions the file holds: the ``model``'s, or as the ``controller`` shows them; None for the
        controller's where the robot file says that they differ.
    out
        CSV file for the configurations, with ``-poses.csv`` for the poses and a page beside it; None writes nothing.
    command
        How to run it again, for the page; None writes the call in Python.

    Raises
    ------
    InputError
        If there is no such set, the cube is given by halves, or the robot can go to none of the poses.
    """
    choice_argument(set, "set", dict.fromkeys(POSE_SETS), "set of poses")
    choice_argument(plane, "plane", dict.fromkeys(PLANES))
    choice_argument(ahead, "ahead", dict.fromkeys(DIRECTIONS))
    number = None if count is None else whole_argument(count, "count", 1, limit("poses"))
    seed = whole_argument(seed, "seed")
    inputs = files_of(robot)
    table = None if out is None else places(out, inputs, "out")[0]
    call = command_argument(command) or python_call(
        "poses",
        robot,
        set,
        centre=centre,
        side=side,
        ahead=ahead,
        nearest=nearest,
        floor=floor,
        plane=plane,
        count=count,
        target=target,
        tip=tip,
        orientation=orientation,
        seed=seed,
        joints=joints,
    )
    arm = robot_argument(robot)
    arm, target = tip_argument(arm, target, tip, "go to the poses")
    own = tip is None
    if not arm.targets:
        arm = arm.with_frames(arm.base, {"flange": (0.0, 0.0, 0.0)})
    turned = _rotation(orientation)
    joints_are = joints_argument(joints, arm)
    near, low = length_argument(nearest, "nearest"), length_argument(floor, "floor")
    cube = _cube_poses(arm, set, centre, side, target, ahead, near, low)
    with refusals_of("count" if number is not None else "set"):
        made = pose_set(arm, set, cube, plane=plane, count=number, target=target, rotation=turned, seed=seed)
    found = PlannedPoses(arm, made, call, inputs, joints_are, own)
    if table is not None:
        found.save(table)
    return found


def _cube_poses(
    arm: Robot,
    set: str,
    centre: Sequence[float] | None,
    side: float | None,
    target: str | None,
    ahead: Direction,
    nearest: float,
    floor: float,
) -> Cube:
    if (centre is None) != (side is None) or (set == "sphere" and centre is None):
        raise InputError(
            "the sphere needs its centre and its size"
            if set == "sphere"
            else "a cube needs its centre and its side, or neither of them",
            parameter="centre, side",
            came="only one of them" if (centre is None) != (side is None) else "neither",
            cure="Give both." if set == "sphere" else "Give both, or leave both out for the largest cube.",
        )
    if centre is None or side is None:
        with refusals_of("ahead"):
            return largest_cube(arm, target=target, ahead=ahead, nearest=nearest, floor=floor)
    middle = lengths_argument(centre, "centre", 3)
    with refusals_of("side"):
        return Cube(np.array(middle), length_argument(side, "side"))


def _rotation(orientation: object) -> Array | None:
    if isinstance(orientation, str):
        return choice_argument(orientation, "orientation", {"free": None, "down": DOWN})
    quaternion = np.array(numbers_argument(orientation, "orientation", 4, "free, down, or a quaternion w, x, y, z"))
    size = math.hypot(*quaternion)
    if abs(size - 1.0) > QUATERNION_TOLERANCE:
        raise InputError(
            "a quaternion (w, x, y, z) has length 1",
            parameter="orientation",
            came=f"length {size:.6g}",
            allowed=f"1 within {QUATERNION_TOLERANCE:g}",
            cure="Divide its numbers by that length, or correct them.",
        )
    return np.asarray(rotation_from_quaternion(quaternion[None] / size)[0])
