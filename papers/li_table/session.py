"""The study's first robot as files, to be calibrated as the document does it, with one command."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from papers.li_table.arm import BOUNDS, TIP, arm, believed
from papers.li_table.run import Outcome
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.robot.robot_file.writing import robot_text

#: Base and tip are known: the camera reads in the robot's base frame, and the tip is at the end of link 3.
_FRAMES: Final = f"""\
truearm: truearm-cell/1
units: {{length: mm, angle: deg}}
tools:
  {TIP}: {{of: flange, translation: [0, 0, 0]}}
frames:
  base: {{of: world, translation: [0, 0, 0], quaternion: [1, 0, 0, 0]}}
"""


def session_files(first: Outcome) -> dict[str, str]:
    """Return robot, known frames, bounds, readings of each table and unseen points, by the names of the files.

    Args:
        first: Of the first seed; joints have no play.
    """
    limits = ", ".join(f"{name}: {size:g}" for name, size in BOUNDS.within.items())
    robot = replace(believed(arm()), name="li3-table", targets=(), known={})
    return {
        "robot.yaml": robot_text(robot),
        "frames.yaml": _FRAMES,
        "bounds.yaml": f"truearm: truearm-bounds/1\nunits: {{length: mm, angle: deg}}\nwithin: {{{limits}}}\n",
        **{f"{surface}.csv": csv_text(data) for surface, data in first.touched.items()},
        "unseen.csv": csv_text(first.unseen),
    }
