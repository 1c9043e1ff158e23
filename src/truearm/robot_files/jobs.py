"""What is asked of robots and their files: joint positions for poses, what is known of them, other formats."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from truearm.engine.command.groups import (
    AtTarget,
    Forced,
    IntoFile,
    IntoNewFile,
    JointsGiven,
    JointsWritten,
    Loaded,
    Near,
    OfData,
    OfRobot,
)
from truearm.engine.command.kinds import ByFlags, Choice, File, Given, Positions, Text, Whole
from truearm.engine.command.request import Request, as_in, job, option, required

if TYPE_CHECKING:
    from truearm.engine.robot.chain import Array
    from truearm.engine.robot.controller import JointsOf
    from truearm.engine.robot.frames import Frame
    from truearm.engine.robot.inverse.pose_solver import Orientation
    from truearm.engine.robot.robot import Robot
    from truearm.robot_files.convert import ConvertedRobot, ExportedMeasurements, ExportedRobot
    from truearm.robot_files.import_ur_kinematics import ImportedKinematics
    from truearm.robot_files.inverse import JointTable
    from truearm.robot_files.show import RobotDescription, RobotList


def _conventions() -> Collection[str]:
    from truearm.engine.robot.conversion import CONVERSIONS

    return CONVERSIONS


def _formats() -> Collection[str]:
    from truearm.robot_files.formats import FORMATS

    return FORMATS


class FindJoints(OfRobot, AtTarget, Near, Loaded, Forced, JointsWritten, IntoFile):
    """Find the joint positions that bring a robot to poses, with its calibration and joint effects.

    The arm is at rest; what depends on the way it came or on temperature is left out.
    """

    job = "inverse"
    words = "ik"
    poses: Array | str | Path = required(
        Given("POSES.csv"),
        "Columns pose, x [mm], y [mm], z [mm], qw, qx, qy, qz.",
        kw_only=False,
        more="Or positions [m], ``(n, 3)``.",
    )
    rotations: Array | None = option(
        Given(),
        "Rotation matrices, ``(n, 3, 3)``.",
        default=None,
        kw_only=False,
        word="",
        shown="with a file, which has its own, or with `orientation=free`",
    )
    branch: str | None = option(
        Text("LABEL|all"),
        "A branch, as front-up-noflip, or all.",
        default=None,
        shown="nearest to the seed",
        more="The nearest is one within the limits.",
    )
    frame: Frame = option(
        Choice(known=("base", "world", "controller")),
        "What the poses are given in: the robot's base, the world, or the base frame of its controller.",
        default="base",
        more="The world is the instrument's frame. In that of the controller the flange is the controller's too, where "
        "a tool is all zeros.",
    )
    orientation: Orientation = option(
        ByFlags(
            known=("full", "axis", "free"),
            flags={
                "free": ("position-only", "Leave the orientation free."),
                "axis": ("axis-only", "Keep the z axis alone, free to turn about it."),
            },
        ),
        "What counts of how the poses are turned: all, the direction of the z axis alone, or nothing.",
        default="full",
    )

    def run(self) -> JointTable:
        """Find them."""
        from truearm.robot_files.inverse import found_joints

        return found_joints(self)


class ShowRobot(OfRobot):
    """Show a robot: its joints, its reach at zero, what is known about it, and where it stands at joint positions.

    That is to be compared with what its pendant shows.
    """

    job = "show"
    joint_positions: Array | Sequence[float] | str | None = option(
        Positions("DEG,DEG,.."),
        "Where the robot stands (mm if sliding): print the pose, too.",
        default=None,
        shown=False,
        more="That is a text; numbers, ``(joints,)``, are in rad, and in m for prismatic joints.",
        formerly="joints",
    )
    joints_are: JointsOf | None = as_in(
        JointsGiven, "joints_are", default=None, shown="the controller's where the robot file says that they differ"
    )

    def run(self) -> RobotDescription:
        """Show it."""
        from truearm.robot_files.show import described

        return described(self)


class ListRobots(Request):
    """List the robots of the library, all or some.

    Of each it says the maker, joints, reach, and whether its controller is known.
    """

    job = "robots"
    refuses = "If the library has no such robot."
    text: str | None = option(
        Text("[TEXT]"),
        "Words of the id or the name, such as 'IRB 1200'.",
        default=None,
        kw_only=False,
        shown="all",
        more="Small letters, blanks, signs and accents are the same as others.",
    )
    maker: str | None = option(Text("NAME"), "Those of a maker.", default=None, shown="all")
    axes: int | None = option(Whole(low=1), "Those with so many joints.", default=None, shown="any number")

    def run(self) -> RobotList:
        """List them."""
        from truearm.robot_files.show import listed_robots

        return listed_robots(self)


class ConvertRobot(OfRobot, IntoNewFile):
    """Write a robot in another kinematic convention, every pose the same.

    Its values become the nominal ones.
    """

    job = "convert"
    refuses = "If there is no such convention, or it cannot describe the robot, or the file exists."
    convention: str = required(
        Choice("NAME", _conventions),
        "The kinematic convention to write it in.",
        kw_only=False,
        word="convention",
        more="One of :data:`truearm.engine.robot.conversion.CONVERSIONS` by name.",
    )

    def run(self) -> ConvertedRobot:
        """Convert it."""
        from truearm.robot_files.convert import converted_robot

        return converted_robot(self)


class ExportRobot(OfRobot, IntoNewFile):
    """Write a robot for other programs, and say what the format cannot hold.

    The robot is a nominal or a calibrated one.
    """

    job = "export"
    refuses = "If there is no such format, or it cannot describe the robot, or the file exists."
    format: str = required(
        Choice("dh|mdh|hayati|urdf|json|python|ur-kinematics", _formats),
        "A standard DH, modified DH or Hayati table (CSV), a URDF, everything as JSON, a Python file for forward and "
        "inverse kinematics that needs only NumPy, or the kinematics file of the ROS driver of Universal Robots.",
        kw_only=False,
        word="format",
        more="One of ``dh``, ``mdh``, ``hayati`` (standard DH with beta between nearly parallel axes), ``urdf``, "
        "``json`` (schema ``truearm-model/1``), ``python`` and ``ur-kinematics``.",
    )

    def run(self) -> ExportedRobot:
        """Export it."""
        from truearm.robot_files.convert import exported_robot

        return exported_robot(self)


class ExportToRobodk(OfData, JointsWritten, IntoNewFile):
    """Write measurements as RoboDK's robot calibration has them: joints, measured points and tool points.

    The robot is a calibrated one, or one whose file has a tool with targets of the names that the data have. The
    measurements are positions, or poses, in the instrument's frame.
    """

    job = "export_robodk"
    refuses = "If the robot has not six turning joints or not these targets, or the data are no positions."

    def run(self) -> ExportedMeasurements:
        """Export them."""
        from truearm.robot_files.convert import exported_measurements

        return exported_measurements(self)


class ImportUrKinematics(IntoNewFile):
    """Write what the controller of a Universal Robots arm computes with as a robot file.

    The values of the robot are what the controller computes with. Its nominal values, masses, limits and tools are
    those of the type, in frames beside the type's.
    """

    job = "import_ur_kinematics"
    words = "import ur-kinematics"
    refuses = (
        "If the file is no such file, is not whole, or is of an arm of another type; if the type is no arm of this "
        "kind; or if `out` exists."
    )
    file: str | Path = required(
        File("FILE"), "calibration.conf of the controller, or the ROS driver's file.", kw_only=False
    )
    robot: Robot | str | Path = as_in(
        OfRobot, "robot", kw_only=False, word="robot", more="It is the arm's type, such as ur5e."
    )

    def run(self) -> ImportedKinematics:
        """Import it."""
        from truearm.robot_files.import_ur_kinematics import imported_kinematics

        return imported_kinematics(self)


inverse = job(FindJoints)
show = job(ShowRobot)
robots = job(ListRobots)
convert = job(ConvertRobot)
export = job(ExportRobot)
export_robodk = job(ExportToRobodk)
import_ur_kinematics = job(ImportUrKinematics)
