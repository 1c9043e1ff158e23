"""Inverse kinematics: joints for poses, on the branch asked for, of the robot as it is."""

from __future__ import annotations

from truearm.modeling.inverse.kinematics import inverse
from truearm.modeling.inverse.solutions import JointSolutions, PoseStatus

__all__ = ["JointSolutions", "PoseStatus", "inverse"]
