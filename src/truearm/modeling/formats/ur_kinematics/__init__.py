"""The kinematics that Universal Robots measures of every arm: what the controller computes with.

They stand in the controller's own file, ``calibration.conf``, as differences to the Denavit-Hartenberg table of the
robot's type, and in the kinematics file of the ROS driver as a chain of frames.
"""

from __future__ import annotations

from truearm.modeling.formats.ur_kinematics.placing import (
    MOST_APART,
    controller_robot,
    mean_distance,
    refuse_far,
    with_kinematics,
)
from truearm.modeling.formats.ur_kinematics.reading import FactoryKinematics, read_kinematics
from truearm.modeling.formats.ur_kinematics.writing import KINEMATICS_FILE, LINKS, kinematics_text

__all__ = [
    "KINEMATICS_FILE",
    "LINKS",
    "MOST_APART",
    "FactoryKinematics",
    "controller_robot",
    "kinematics_text",
    "mean_distance",
    "read_kinematics",
    "refuse_far",
    "with_kinematics",
]
