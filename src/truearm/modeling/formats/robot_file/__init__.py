"""Robot files: one YAML file is one robot, nominal or calibrated.

Lengths are written in the file's own units and kept in SI inside. Reading a file and writing it again gives the
same file from the second time on.
"""

from __future__ import annotations

from truearm.modeling.formats.robot_file.reading import read_robot, robot_from_file
from truearm.modeling.formats.robot_file.schema import RobotFile
from truearm.modeling.formats.robot_file.seal import arm_is_known, is_intact, sealed
from truearm.modeling.formats.robot_file.writing import robot_text

__all__ = ["RobotFile", "arm_is_known", "is_intact", "read_robot", "robot_from_file", "robot_text", "sealed"]
