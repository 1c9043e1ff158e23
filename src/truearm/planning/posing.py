"""Poses of a named set: those of ISO 9283 in a cube, and those on a sphere."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from truearm.engine.base.errors import InputError, Notice, Rule, counted, degrees, listed, millimetres, refusals_of
from truearm.engine.base.limits import limit
from truearm.engine.base.writing import output_file, write_files
from truearm.engine.command.arguments import files_of, joints_argument, robot_argument, whole_argument
from truearm.engine.command.driving import tip_argument
from truearm.engine.data.controller_joints import in_controller_joints
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.document.document import Block, detail, say
from truearm.engine.document.records import Record, joints_lines
from truearm.engine.motion.cube import DOWN, Cube
from truearm.engine.motion.largest_cube import largest_cube
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import JointsOf
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import quaternion_from_rotation, rotation_from_quaternion
from truearm.planning.pose_sets import PoseSet, pose_set

if TYPE_CHECKING:
    from truearm.planning.poses import PosesOfSet

#: What the page beside a set ends with.
PAGE: Final = ".html"
#: What is put behind the name of a set to name the file of its poses.
POSES: Final = "-poses.csv"


UNREACHABLE_POSES: Final = Rule(
    "unreachable-poses",
    "error",
    "poses of the set that the robot cannot go to; the files do not have them",
    cure="Take another centre, a smaller side, or another orientation.",
)


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
            UNREACHABLE_POSES(
                f"{counted(len(missed), 'pose')} of the set {self.made.name} cannot be reached within the joint limits "
                f"and {'is' if len(missed) == 1 else 'are'} left out: {listed(missed)}."
            ),
        )

    @property
    def answer(self) -> list[str]:
        """What the set is, in words."""
        poses = self.made
        first = f"{counted(len(poses.labels), 'pose')} of the set {poses.name}{self._in_cube()}."
        return [first, *(self._moves() if poses.name == "118" else ())]

    def blocks(self) -> Iterator[Block]:
        """Give what the set is, and where, in mm."""
        poses = self.made
        missed = list(poses.missed)
        yield say(*self.answer, set=poses.name, poses=len(poses.labels), target=poses.target, missed=missed)
        if poses.cube is not None:
            yield say(cube_mm={"centre": (poses.cube.centre * 1e3).tolist(), "side": poses.cube.side * 1e3})
        yield detail(*joints_lines(self.joints_are), joints_are=self.joints_are)

    def _moves(self) -> list[str]:
        """Return by how much every joint moves from one pose to the next."""
        moves = np.abs(np.diff(self.joints, axis=0)).min(axis=0, initial=np.inf)
        words = {"revolute": degrees, "prismatic": millimetres}
        units = {"revolute": "deg", "prismatic": "mm"}
        sizes = []
        for kind in words:
            of_kind = [move for move, joint in zip(moves, self.robot.joints, strict=True) if joint.kind == kind]
            if of_kind and np.isfinite(min(of_kind)):
                sizes.append(f"{words[kind](min(of_kind))} {units[kind]}")
        return [f"Every joint moves by {' or '.join(sizes)} or more from one pose to the next."] if sizes else []

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

    def written_at(self, out: str) -> str:
        """Return the line that says which files hold it."""
        file = Path(out)
        return f"Written: {file}, {file.with_name(file.stem + POSES)}, {file.with_suffix(PAGE)}"

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

    def _in_cube(self) -> str:
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


def _shown(value: float, decimals: int) -> str:
    return repr(round(value, decimals) + 0.0)


def posed(asked: PosesOfSet) -> PlannedPoses:
    """Find the poses of a set and the joint positions that reach them, and write them."""
    count = None if asked.count is None else whole_argument(asked.count, "count", 1, limit("poses"))
    inputs = files_of(asked.robot)
    table = None if asked.out is None else places(asked.out, inputs, "out")[0]
    arm, target = tip_argument(robot_argument(asked.robot), asked.target, asked.tip, "go to the poses")
    if not arm.targets:
        arm = arm.with_frames(arm.base, {"flange": (0.0, 0.0, 0.0)})
    joints_are = joints_argument(asked.joints, arm)
    cube = _cube_poses(asked, arm, target)
    rotation = _rotation(asked.tip_orientation)
    with refusals_of("set" if count is None else "count"):
        poses = pose_set(
            arm, asked.set, cube, plane=asked.plane, count=count, target=target, rotation=rotation, seed=asked.seed
        )
    planned_poses = PlannedPoses(arm, poses, asked.again, inputs, joints_are, asked.tip is None)
    if table is not None:
        planned_poses.save(table)
    return planned_poses


def _cube_poses(asked: PosesOfSet, arm: Robot, target: str | None) -> Cube:
    if asked.centre is None or asked.side is None:
        with refusals_of("ahead"):
            return largest_cube(arm, target=target, ahead=asked.ahead, nearest=asked.nearest, floor=asked.lowest)
    with refusals_of("side"):
        return Cube(np.array(asked.centre), asked.side)


def _rotation(orientation: str | Sequence[float]) -> Array | None:
    if isinstance(orientation, str):
        return DOWN if orientation == "down" else None
    quaternion = np.array(orientation)
    return np.asarray(rotation_from_quaternion(quaternion[None] / math.hypot(*quaternion))[0])
