"""What ways to begin are asked for: a small session, a robot file to fill in, the main job on a twin."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from truearm.engine.command.groups import Long
from truearm.engine.command.kinds import File
from truearm.engine.command.request import Request, job, option, required

if TYPE_CHECKING:
    from truearm.starting.demo import Demonstration
    from truearm.starting.example import ExampleSession, RobotTemplate


class WriteExample(Request):
    """Write a small complete session to imitate: a robot, its data, data to check with, the commands."""

    job = "example"
    refuses = "If one of the files exists."
    folder: str | Path = required(
        File("DIR"), "Folder to write into.", kw_only=False, more="Nothing in it is overwritten."
    )

    def run(self) -> ExampleSession:
        """Write it."""
        from truearm.starting.example import session

        return session(self)


class NewRobot(Request):
    """Write a commented robot file to fill in."""

    job = "new_robot"
    refuses = "If the file exists or cannot be written."
    file: str | Path = required(File("FILE"), "Robot file to write.", kw_only=False, more="It must not exist yet.")

    def run(self) -> RobotTemplate:
        """Write it."""
        from truearm.starting.example import new_file

        return new_file(self)


class Demonstrate(Long):
    """Run the main job on a built-in digital twin of an ABB IRB 120: calibrate it and correct a program.

    The truth is the robot that Nubiola's thesis identified (Tables 2.6 and 2.7), with its compliance, and with gears
    that err by 0.01 deg two hundred times in a turn.
    """

    job = "demo"
    refuses = "If the folder holds other measurements or another program: they are not overwritten."
    out: str | Path = option(
        File("DIR"), "Folder for data and results.", default="truearm-demo", repeated=False, kw_only=False, word="out"
    )

    def run(self) -> Demonstration:
        """Calibrate and correct."""
        from truearm.starting.demo import demonstrated

        return demonstrated(self)


example = job(WriteExample)
new_robot = job(NewRobot)
demo = job(Demonstrate)
