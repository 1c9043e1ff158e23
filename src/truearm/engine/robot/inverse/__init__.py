"""Inverse kinematics: joints for poses, on the branch asked for, of the robot as it is."""

from __future__ import annotations

from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.inverse.pose_solver import JointSolutions, PoseStatus

__all__ = ["JointSolutions", "PoseStatus", "inverse"]
