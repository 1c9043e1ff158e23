"""The joints that bring a robot to poses."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from truearm.arrays import axes
from truearm.errors import InputError, refusals_of, wrong_kind
from truearm.files import path_argument
from truearm.identification.judging.external_force import check_force
from truearm.jobs.arguments import (
    array_argument,
    choice_argument,
    file_for,
    gravity_argument,
    joints_argument,
    payload_argument,
    pushed_argument,
    robot_argument,
    wrench_argument,
)
from truearm.jobs.proof import told_of
from truearm.measurement.readers.poses import read_poses
from truearm.modeling.chain import Array
from truearm.modeling.controller import JointsOf
from truearm.modeling.formats.joint_columns import counting
from truearm.modeling.formats.joint_table import joints_csv
from truearm.modeling.frames import FRAMES, Frame, frame_and_tip
from truearm.modeling.inverse import inverse as inverse_kinematics
from truearm.modeling.inverse.pose_solver import Orientation
from truearm.modeling.parts import Payload
from truearm.modeling.robot import Robot
from truearm.modeling.transform import IDENTITY, rotation_from_quaternion
from truearm.modeling.wrench import Wrench, WrenchFrame
from truearm.notices import Notice
from truearm.results.joint_table import JointTable
from truearm.writing import write_text


def inverse(
    robot: Robot | str | Path,
    poses: Array | str | Path,
    rotations: Array | None = None,
    *,
    out: str | Path | None = None,
    branch: str | None = None,
    seed: Array | Sequence[float] | None = None,
    target: str | None = None,
    frame: Frame = "base",
    orientation: Orientation = "full",
    payload: Payload | str | None = None,
    gravity: Sequence[float] | None = None,
    wrench: Wrench | Sequence[float] | str | None = None,
    wrench_frame: WrenchFrame | None = None,
    joints: JointsOf | None = None,
) -> JointTable:
    """Find the joints that bring a robot to poses, with its calibration and joint effects.

    The arm is at rest; what depends on the way it came or on temperature is left out.

    Parameters
    ----------
    robot
        A robot, or what :func:`truearm.load_robot` takes.
    poses
        Positions [m], ``(n, 3)``, or a CSV file with the columns pose, x [mm], y [mm], z [mm], and qw, qx, qy, qz.
    rotations
        Rotation matrices, ``(n, 3, 3)``; None with a file, which has its own, or with ``orientation="free"``.
    out
        CSV file to write; None writes nothing.
    branch
        A branch by name, as ``front-up-noflip``; ``all``; or None for the one nearest to the seed within the limits.
    seed
        Joint positions of the model ``(joints,)`` or ``(n, joints)`` [rad; m for prismatic joints] near which the
        answer shall lie; zero if None.
    target
        Name of the target that shall be there; the flange if None.
    frame
        What the poses are given in: ``base``, the robot's base; ``world``, the instrument's frame; or ``controller``,
        the base frame of the robot's controller. There the flange is the controller's too, where a tool is all zeros.
    orientation
        ``full``; ``axis`` if only the direction of the z axis counts; ``free`` if only the position does.
    payload, gravity
        What the robot carries (an object, or a text such as ``2.7kg,50mm,25mm,100mm``) and free fall in its base frame
        [m/s^2]; None for what its file says.
    wrench
        External force and moment on what goes to the poses, the target or the flange: six numbers [N, N m], a text such
        as ``0N,0N,80N,0Nm,0Nm,1.5Nm``, or an object; None for none.
    wrench_frame
        Whose axes it is given in: ``base`` (also for None), ``tool``, those of the target or the flange, ``world`` or
        ``controller``.
    joints
        Whose joint positions the file holds: the ``model``'s, or as the ``controller`` shows them; None for the
        controller's where the robot file says that they differ.

    Raises
    ------
    InputError
        For anything that cannot be used, with a message that says what to do.
    """
    file = None if out is None else file_for(out, robot, poses)
    choice_argument(frame, "frame", dict.fromkeys(FRAMES))
    choice_argument(orientation, "orientation", dict.fromkeys(("full", "axis", "free")))
    pushed = wrench_argument(wrench, wrench_frame)
    arm = robot_argument(robot).with_payload(payload_argument(payload), gravity_argument(gravity))
    joints_are = joints_argument(joints, arm)
    if target is not None:
        choice_argument(target, "target", {known.name: known for known in arm.targets})
    tip = frame_and_tip(arm, frame, None)[1] if target is None and frame == "controller" else arm.tool_place(target)
    arm = pushed_argument(arm, pushed, tip)
    if branch is not None and not isinstance(branch, str):
        raise wrong_kind("the name of a branch belongs here", branch, "branch", "front-up-noflip, for example, or all")
    labels, positions, turned = _poses(poses, rotations)
    if turned is None and orientation != "free":
        given = isinstance(poses, str | Path)
        raise InputError(
            "the poses have no orientation",
            parameter="poses" if given else "rotations",
            where=str(poses) if given else None,
            allowed="the columns qw, qx, qy, qz" if given else "rotation matrices, (n, 3, 3)",
            cure="Add them, or use `orientation=free`.",
        )
    near = None
    if seed is not None:
        one = axes(seed) != 2
        shape = (len(arm.joints),) if one else (len(positions), len(arm.joints))
        near = array_argument(seed, "seed", shape, f"{len(arm.joints)} numbers, one for each joint of {arm.name}")
    with refusals_of("robot"):
        solutions = inverse_kinematics(
            arm, positions, turned, target=target, frame=frame, branch=branch, seed=near, orientation=orientation
        )
    if file is not None:
        write_text(file, joints_csv(solutions, labels, arm.joints, counting(arm, joints_are)))
    told = (*told_of(arm), *check_force([(arm, solutions.joints[solutions.usable])]))
    return JointTable(labels, solutions, (*told, *_other_frame(arm, frame, target)), joints_are, arm.simulated_from)


def _other_frame(robot: Robot, frame: Frame, target: str | None) -> list[Notice]:
    """Say if poses were taken in the model's base frame, and a pendant would show them in another."""
    controller = robot.controller
    alike = controller.base == IDENTITY and (target is not None or controller.flange == IDENTITY)
    if frame != "base" or alike:
        return []
    return [
        Notice(
            "model-frame",
            "The poses were taken as those of the model's flange in its base frame. The controller has them elsewhere "
            "('truearm show' says where): for poses that the pendant shows use `frame=controller`.",
            "note",
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
