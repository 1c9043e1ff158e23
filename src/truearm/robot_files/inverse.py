"""The joints that bring a robot to poses, and their table."""

from __future__ import annotations

import csv
import io
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from truearm.engine.base.arrays import axes
from truearm.engine.base.errors import InputError, Notice, Rule, refusals_of
from truearm.engine.base.files import path_argument
from truearm.engine.base.units import Marked
from truearm.engine.base.writing import write_text
from truearm.engine.command.arguments import (
    array_argument,
    choice_argument,
    file_for,
    joints_argument,
    pushed_argument,
    robot_argument,
    wrench_argument,
)
from truearm.engine.command.split import faults_of
from truearm.engine.command.texts import positions_of
from truearm.engine.data.readers.configurations import read_poses
from truearm.engine.diagnose.external_force import check_force
from truearm.engine.document.document import Block, say
from truearm.engine.document.records import Record, joints_lines
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import Controller, JointsOf
from truearm.engine.robot.frames import Frame, frame_and_tip
from truearm.engine.robot.inverse.kinematics import inverse as inverse_kinematics
from truearm.engine.robot.inverse.pose_solver import JointSolutions, PoseStatus
from truearm.engine.robot.parts import Joint
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY, rotation_from_quaternion
from truearm.engine.robot.urdf_writing import counting, joint_cells, joint_headings

if TYPE_CHECKING:
    from truearm.robot_files.jobs import FindJoints


def joints_csv(
    solutions: JointSolutions, labels: Sequence[str], joints: Sequence[Joint], controller: Controller | None = None
) -> str:
    """Return solutions as CSV, one row a pose and branch, joints in deg or mm.

    Args:
        labels: Name of each pose.
        joints: Of the robot.
        controller: Who shows the joint positions, ``axis_i``; None for the model's, ``joint_i``.
    """
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(
        [
            "pose",
            "branch",
            "status",
            *joint_headings(joints, controller),
            "position_error [mm]",
            "orientation_error [mrad]",
        ]
    )
    for row, positions in enumerate(joint_cells(solutions.joints, joints, controller)):
        angle = float(solutions.orientation_error[row])
        writer.writerow(
            [
                labels[solutions.pose[row]],
                solutions.branch[row],
                solutions.status[row].value,
                *positions,
                f"{solutions.position_error[row] * 1e3:.6g}",
                "" if math.isnan(angle) else f"{angle * 1e3:.6g}",
            ]
        )
    return stream.getvalue()


@dataclass(frozen=True, eq=False, repr=False)
class JointTable(Record):
    """Joints for poses."""

    labels: tuple[str, ...]  #: Name of each pose.
    solutions: JointSolutions  #: What was found, one row a pose, or one a pose and branch.
    warnings: tuple[Notice, ...] = ()  #: What speaks against the calibration of the robot.
    #: Whose joint positions the file holds: the ``model``'s, or those that the ``controller`` shows.
    joints_are: JointsOf = "model"
    simulated_from: tuple[Marked, ...] = ()  #: What of it comes from a virtual instrument.

    @property
    def joints(self) -> Array:
        """Joint positions of each row, of the model [rad; m for prismatic joints], ``(rows, joints)``."""
        return self.solutions.joints

    @property
    def status(self) -> tuple[PoseStatus, ...]:
        """How the search for each row ended."""
        return self.solutions.status

    @property
    def complete(self) -> bool:
        """Whether the robot can go to every pose."""
        return self.solutions.complete

    @property
    def finished(self) -> bool:
        """Whether the robot can go to every pose."""
        return self.complete

    def written_at(self, out: str) -> str:
        """Return the line that says where it was written."""
        return f"Written to {out}"

    @property
    def attention(self) -> tuple[dict[str, str], ...]:
        """Every pose that the robot cannot or should not just go to: its name, branch and status, and what to do."""
        joint_solutions = self.solutions
        reached = set(joint_solutions.pose[joint_solutions.usable].tolist())
        return tuple(
            {
                "pose": self.labels[pose],
                "branch": joint_solutions.branch[row],
                "status": status.value,
                "advice": joint_solutions.advice(row),
            }
            for row, (pose, status) in enumerate(
                zip(joint_solutions.pose.tolist(), joint_solutions.status, strict=True)
            )
            if status.value != "reached" and (status.usable or pose not in reached)
        )

    def blocks(self) -> Iterator[Block]:
        """Give how many poses are reached, and what is wrong with the others."""
        joint_solutions = self.solutions
        reached, status = (
            len(set(joint_solutions.pose[joint_solutions.usable].tolist())),
            Counter(pose_status.value for pose_status in joint_solutions.status),
        )
        counts = ", ".join(f"{count} {name}" for name, count in status.items())
        yield say(
            f"{reached} of {joint_solutions.poses} poses reached. Rows: {counts}",
            poses=joint_solutions.poses,
            poses_reached=reached,
            rows=len(joint_solutions.status),
            joints_are=self.joints_are,
            status=dict(status),
        )
        for entry in self.attention:
            name = f"{entry['pose']} ({entry['branch']})" if entry["branch"] else entry["pose"]
            yield say(f"  {name}: {entry['status']}. {entry['advice']}")
        yield say(attention=[*self.attention])
        yield say(*joints_lines(self.joints_are))


def found_joints(asked: FindJoints) -> JointTable:
    """Find the joint positions for poses, and write their table."""
    file = None if asked.out is None else file_for(asked.out, asked.robot, asked.poses)
    arm = _arm(asked)
    joints_are = joints_argument(asked.joints, arm)
    labels, positions, turned = _poses(asked.poses, asked.rotations)
    if turned is None and asked.orientation != "free":
        is_file = isinstance(asked.poses, str | Path)
        raise InputError(
            "the poses have no orientation",
            parameter="poses" if is_file else "rotations",
            where=str(asked.poses) if is_file else None,
            allowed="the columns qw, qx, qy, qz" if is_file else "rotation matrices, (n, 3, 3)",
            cure="Add them, or use `orientation=free`.",
        )
    near = _near(asked, arm, joints_are, len(positions))
    with refusals_of("robot"):
        solutions = inverse_kinematics(
            arm,
            positions,
            turned,
            target=asked.target,
            frame=asked.frame,
            branch=asked.branch,
            seed=near,
            orientation=asked.orientation,
        )
    if file is not None:
        write_text(file, joints_csv(solutions, labels, arm.joints, counting(arm, joints_are)))
    warnings = (*faults_of(arm), *check_force([(arm, solutions.joints[solutions.usable])]))
    notices = (*warnings, *_other_frame(arm, asked.frame, asked.target))
    return JointTable(labels, solutions, notices, joints_are, arm.simulated_from)


def _arm(asked: FindJoints) -> Robot:
    """Return the robot with what it carries, and with what acts on what goes to the poses."""
    pushed = wrench_argument(asked.wrench, asked.wrench_frame)
    arm, target = asked.loads.on(robot_argument(asked.robot)), asked.target
    if target is not None:
        choice_argument(target, "target", {known.name: known for known in arm.targets})
    of_controller = target is None and asked.frame == "controller"
    tip = frame_and_tip(arm, asked.frame, None)[1] if of_controller else arm.tool_place(target)
    return pushed_argument(arm, pushed, tip)


def _near(asked: FindJoints, arm: Robot, joints_are: JointsOf, poses: int) -> Array | None:
    """Return the joint positions near which the answer shall lie; None for zeros."""
    if asked.seed_joints is None:
        return None
    seed = positions_of(asked.seed_joints, arm, joints_are, "seed_joints")
    shape = (len(arm.joints),) if axes(seed) != 2 else (poses, len(arm.joints))
    return array_argument(seed, "seed_joints", shape, f"{len(arm.joints)} numbers, one for each joint of {arm.name}")


MODEL_FRAME: Final = Rule(
    "model-frame", "note", "the poses were taken in the model's base frame, and the pendant shows them in another"
)


def _other_frame(robot: Robot, frame: Frame, target: str | None) -> list[Notice]:
    """Say if poses were taken in the model's base frame, and a pendant would show them in another."""
    controller = robot.controller
    alike = controller.base == IDENTITY and (target is not None or controller.flange == IDENTITY)
    if frame != "base" or alike:
        return []
    return [
        MODEL_FRAME(
            "The poses were taken as those of the model's flange in its base frame. The controller has them elsewhere "
            "('truearm show' says where): for poses that the pendant shows use `frame=controller`."
        )
    ]


def _poses(poses: object, rotations: object) -> tuple[tuple[str, ...], Array, Array | None]:
    """Return names, positions and rotations of poses from a file or from arrays."""
    if isinstance(poses, str | Path):
        with refusals_of("poses"):
            read = read_poses(path_argument(poses, "poses"))
        if rotations is not None:
            raise InputError(
                "the file says how the poses are turned",
                parameter="rotations",
                cure="Leave `rotations` out, or give positions.",
            )
        turned = None if read.quaternion is None else rotation_from_quaternion(read.quaternion)
        return read.labels, read.position, turned
    positions = array_argument(poses, "poses", ("n", 3), "positions in m, (n, 3), or a CSV file")
    labels = tuple(str(number + 1) for number in range(len(positions)))
    if rotations is None:
        return labels, positions, None
    allowed = f"rotation matrices, ({len(positions)}, 3, 3)"
    return labels, positions, array_argument(rotations, "rotations", (len(positions), 3, 3), allowed)
