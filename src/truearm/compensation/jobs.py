"""What corrections are asked for: of programs, and of a path."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from truearm.engine.base.errors import InputError
from truearm.engine.command.groups import (
    Accepting,
    Carrying,
    Commanded,
    Forced,
    ForceFrame,
    IntoFolder,
    JointsWritten,
    Loaded,
    Long,
    Near,
    Noted,
    OfCell,
    OfController,
    OfRobot,
    Repeatable,
)
from truearm.engine.command.kinds import Choice, File, Files, Flag, Names, Number, Text, WrenchKind
from truearm.engine.command.request import Request, job, option, required

if TYPE_CHECKING:
    from truearm.compensation.corrected_path import TargetKind
    from truearm.compensation.path import FollowedPath
    from truearm.compensation.result import ProgramCorrection, RestoredPrograms
    from truearm.engine.robot.wrench import Wrench


def _taught() -> Collection[str]:
    from truearm.engine.programs.chosen_targets import TAUGHT

    return [*TAUGHT, "none"]


def _languages() -> Collection[str]:
    from truearm.engine.programs import BY_NAME

    return [*BY_NAME, "all"]


@dataclass(frozen=True)
class TaughtKind(Names):
    """What was taught: nothing, or some of what can be."""

    def check(self, value: Any, name: str) -> Any:
        """Refuse an empty answer, and one that is nothing and something."""
        named = super().check(value, name)
        if not named or ("none" in named and len(named) > 1):
            *some, none = _taught()
            raise InputError(
                "what was taught is not clear",
                parameter=name,
                came=", ".join(named) or "nothing",
                allowed=f"{none}, or some of {', '.join(some)}",
            )
        return named


class OfPrograms(Request):
    """Which programs."""

    programs: Sequence[str | Path] = required(
        Files("PROGRAM...", "program"),
        "RAPID, KRL, FANUC LS, URScript, Yaskawa JBI or VAL3 files.",
        kw_only=False,
    )


class Revert(OfPrograms, IntoFolder):
    """Restore the originals of corrected programs from the records beside them."""

    job = "revert"
    refuses = "If a program has no record or was changed since, or a file would be overwritten."

    @classmethod
    def command_words(cls) -> str:
        """Return the words of the command, of which it is a flag."""
        return f"{Compensate.job} CALIBRATED.yaml --{cls.job}"

    def run(self) -> RestoredPrograms:
        """Restore."""
        from truearm.compensation.compensate import reverted

        return reverted(self)


class Compensate(
    OfPrograms,
    OfRobot,
    OfCell,
    Carrying,
    ForceFrame,
    OfController,
    Accepting,
    Noted,
    IntoFolder,
    Commanded,
    Long,
):
    """Correct robot programs so that the real robot goes where they say.

    The robot is a calibrated one, and programs that are given together share what has to be assumed of base and flange.
    Where no payload is given, it is what the program says of each tool, and what was carried in calibration where it
    does not say it. Only the numbers of targets change, and a comment says so, with the date that is noted or today's.
    Beside each program NAME.truearm.json records what was done, and holds the original; compensation.html shows how far
    each target was moved.
    """

    job = "compensate"
    instead = Revert
    refuses = (
        "If a program cannot be read or was corrected already, the robot is not calibrated or its calibration ended "
        "badly or is another maker's, a tool or frame is not defined, a target cannot be corrected and that is not "
        "accepted, or would be moved or turned farther than the robot's errors explain, or nothing says what was "
        "taught, or with what a controller computes whose maker offers a calibration."
    )
    wrench: Wrench | Sequence[float] | str | Path | None = option(
        WrenchKind("FX,FY,FZ,MX,MY,MZ|FILE"),
        "What acts on the tool at every target besides weight, a force [N] at its point and a moment [N m]; or a file "
        "that says it of targets and tools by name.",
        default=None,
        shown="nothing",
        more="Six numbers, a text such as ``0N,0N,80N,0Nm,0Nm,1.5Nm``, an object, or a file, see "
        ":mod:`truearm.engine.programs.cell`, which says the frames itself.",
    )
    split: float | None = option(
        Number("mm", low=1e-3, high=100.0),
        "Split straight and circular moves where the correction in between would deviate farther.",
        default=None,
        shown=False,
    )
    again: bool = option(Flag(), "Correct the originals of programs corrected before, anew.", default=False)
    joint_targets: str = option(
        Choice(known=("keep", "correct")),
        "What becomes of targets that are given by joints.",
        default="keep",
        more="``keep`` leaves them as they are, home positions for instance; ``correct`` sends the real robot where "
        "the nominal one would be.",
    )
    only: Sequence[str] = option(
        Names(example="names of targets", commas=False),
        "Correct only targets of this name or pattern.",
        default=(),
        more="A pattern is one such as ``pHole*``.",
    )
    keep: Sequence[str] = option(
        Names(example="names of targets", commas=False), "Targets of this name or pattern stay.", default=()
    )
    taught: Sequence[str] | None = option(
        TaughtKind("LIST", known=_taught, what="answer", repeated=False),
        "What was taught with this robot, and is right already: points, frames, tools, or none.",
        default=None,
        shown="as a cell file says, else asked",
        more="It is none if all was computed off-line.",
    )

    @property
    def wrench_file(self) -> Path | None:
        """The file that says what acts on tools; None if that is said otherwise, or not at all."""
        from truearm.engine.base.files import path_argument

        named = isinstance(self.wrench, str) and self.wrench.lower().endswith((".yaml", ".yml"))
        return path_argument(self.wrench, "wrench") if named or isinstance(self.wrench, Path) else None

    def check(self) -> None:
        """Refuse a frame beside a file that has frames."""
        if self.wrench_frame is not None and self.wrench_file is not None:
            raise InputError("the file says the frame of each force", parameter="wrench_frame", came=self.wrench_frame)

    def run(self) -> ProgramCorrection:
        """Correct."""
        from truearm.compensation.compensate import corrected

        return corrected(self)


class FollowPath(OfRobot, Near, Loaded, Forced, OfController, Accepting, JointsWritten, IntoFolder, Repeatable):
    """Follow a path of lines, circles and waypoints, and correct it for the calibrated robot.

    Writes motion.csv, corrected.csv, loads.csv, report.html, and the corrected path as programs. A robot that is
    nominal follows the path, and there is nothing to correct.
    """

    job = "path"
    refuses = (
        "If the file is malformed, or the robot cannot follow the path: with the place on it. If the correction of a "
        "program is larger than the robot's errors explain."
    )
    file: str | Path = required(
        File("PATH.yaml"),
        "Lines, circles and waypoints with a time law.",
        kw_only=False,
        more="See :mod:`truearm.engine.motion.path_file`.",
    )
    languages: Sequence[str] = option(
        Names("LANGUAGE", known=_languages, what="language", commas=False),
        "A language to write the corrected path in: rapid, krl, fanuc-ls, urscript, inform, val3 or all.",
        default=(),
        word="program",
        formerly="programs",
    )
    move_to: TargetKind = option(
        Choice(known=("joints", "poses"), what="kind of targets"),
        "What programs move to: joint positions, or straight to poses.",
        default="joints",
        formerly="targets",
    )
    spacing: float = option(
        Number("s", low=0.0, above=True),
        "Time from one target of a program to the next.",
        default=0.02,
        more="Or a little less; that of the file's samples at the least.",
    )
    name: str = option(Text("NAME"), "Of the programs.", default="truearm_path")

    def run(self) -> FollowedPath:
        """Follow it."""
        from truearm.compensation.path import follow

        return follow(self)


compensate = job(Compensate)
revert = job(Revert)
path = job(FollowPath)
