"""The corrected program in a project's folder: whether it is of the program, result and settings as they are now."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

from truearm.compensation.result import REPORT
from truearm.engine.base.errors import InputError, Words
from truearm.engine.base.files import exists, read_bytes, read_text, read_yaml
from truearm.engine.base.manifest import hash_of, sets_in
from truearm.engine.programs.cell import Answers, CellFile, read_answers
from truearm.engine.programs.program_files import CorrectionRecord, ProgramFile, correction_record, program_files
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.entries import STATED, controller_summary
from truearm.engine.robot.wrench import Wrench
from truearm.studio.project import Project
from truearm.studio.settings import Settings

CellPart = Literal["tools", "frames"]
_PARTS: Final[tuple[CellPart, ...]] = ("tools", "frames")

#: The entry that a kinematics file begins with; robot files have it under their controller.
_KINEMATICS: Final = re.compile(r"^kinematics[ \t]*+:", re.M)


@dataclass(frozen=True)
class Corrected:
    """A correction that stands in the folder, of the program that is chosen."""

    name: str  #: Of the corrected program, in the project.
    #: The paths of the program, first the one that is chosen, and of the files that belong to it.
    files: tuple[Path, ...]
    report: Path | None  #: The path of its report; None where that is of another correction, or missing.
    changed: tuple[str, ...]  #: What is not as it was corrected with, in words; empty if nothing is.

    @property
    def told(self) -> str:
        """What to know of one that is of another state of the project."""
        changed = ", ".join(self.changed)
        return f"{self.name} was corrected from another state of the project. Changed since: {changed}."

    def refuse_other(self) -> None:
        """Refuse to hand out what is of another state of the project.

        Raises:
            InputError: With what has changed.
        """
        if self.changed:
            raise InputError(
                "the program was corrected from another state of the project",
                parameter="corrected",
                where=self.name,
                came=Words(f"changed since: {', '.join(self.changed)}"),
                cure="Correct it again.",
            )


def cell_parts(path: Path) -> tuple[CellPart, ...]:
    """Return what a file of tools and frames has, as the job takes it; both where it has neither, which it refuses."""
    content = read_yaml(path, CellFile)
    return tuple(part for part in _PARTS if getattr(content, part)) or _PARTS


def kinematics_files(project: Project) -> list[str]:
    """Return the files of a project that say what a controller computes with: calibration.conf, or the driver's."""
    written = (name for name in project.names(".yaml", ".yml") if _is_kinematics(project, name))
    return [*project.names(".conf"), *written]


def _is_kinematics(project: Project, name: str) -> bool:
    """Return whether a file looks like one of kinematics, as the ROS driver's program writes it."""
    try:
        return _KINEMATICS.search(read_text(project.path(name), "yaml_size")) is not None
    except InputError:
        return False


def corrected_now(project: Project, robots: Callable[[], tuple[Robot | None, str]]) -> Corrected | None:
    """Return the correction of the chosen program that stands in the folder; None if there is none.

    Args:
        robots: Gives the calibrated robot, and which robot the result is of where that is not the one that is chosen.
    """
    folder, program = project.file("corrected"), project.file("program")
    if folder is None or program is None or not exists(folder / program.name):
        return None
    corrected = folder / program.name
    name = project.relative(corrected)
    try:
        record = correction_record(corrected)
    except InputError:
        return Corrected(name, (corrected,), None, ("its record",))
    if record is None:  # another program's file
        return None
    together = any({program.name, REPORT} <= {*one.files} for one in sets_in(folder))
    try:
        files = tuple(folder / file.name for file in program_files([program]))
    except InputError:
        files = (corrected,)
    report = folder / REPORT if together and exists(folder / REPORT) else None
    return Corrected(name, files, report, tuple(dict.fromkeys(_changed(project, folder, program, record, robots))))


def _changed(
    project: Project,
    folder: Path,
    program: Path,
    record: CorrectionRecord,
    robots: Callable[[], tuple[Robot | None, str]],
) -> Iterator[str]:
    """Return what is not as it was when the program was corrected."""
    settings, applied = project.settings, record.applied
    try:
        files = program_files([program])
    except InputError:
        yield "the program"
    else:
        for file in files:
            yield from _changed_file(file, folder)
    said: dict[str, Any] = applied.get("inputs_sha256") or {}
    try:
        calibrated, other = robots()
    except InputError:
        yield "the robot, which cannot be read"
        return
    if other:
        yield f"the robot, {other} then"
    if "robot" not in said:
        yield "the result, of which the record says nothing"
    elif calibrated is None or said["robot"] != _hash_of(project, f"{settings.result}/calibrated.yaml"):
        yield "the result"
    answers = Answers()
    try:
        cell = None if settings.cell is None else project.path(settings.cell)
        parts = () if cell is None else cell_parts(cell)
        answers = read_answers({"cell": cell})
    except InputError:
        parts = _PARTS
    if any(said.get(part) != (_hash_of(project, settings.cell) if part in parts else None) for part in _PARTS):
        yield "tools and frames"
    if said.get("wrench") != _hash_of(project, settings.wrench_file) or (
        settings.wrench_file is None and applied.get("wrenches", []) != _acting(settings)
    ):
        yield "the process force"
    taught = answers.taught if settings.taught is None else settings.taught
    if applied.get("taught") != (None if taught is None else sorted({*taught} - {"none"})):
        yield "what was taught"
    kinematics, read = settings.controller_kinematics, None
    if kinematics is None and answers.controller_kinematics is not None:
        said_there = answers.controller_kinematics
        kinematics = said_there if said_there in STATED else os.path.relpath(said_there, project.folder)
    if kinematics is not None and kinematics not in STATED:
        read = _hash_of(project, kinematics)
        same = read is not None
    elif kinematics is None:
        same = calibrated is None or applied.get("controller") == controller_summary(calibrated.controller.kinematics)
    else:
        same = applied.get("controller") == controller_summary(STATED[kinematics])
    if not same or said.get("controller_kinematics") != read:
        yield "what the controller has"


def _acting(settings: Settings) -> list[dict[str, Any]]:
    """Return what acts on the tool by the numbers of the settings, as a record has it; nothing if they are none."""
    if settings.wrench is None:
        return []
    try:
        said = Wrench.of(settings.wrench, settings.wrench_axes or "base")
    except InputError:
        return []
    return [{"force_n": [*said.force], "moment_nm": [*said.moment], "frame": said.frame}] if said.acts else []


def _changed_file(file: ProgramFile, folder: Path) -> Iterator[str]:
    """Return what of a program's file is not as it was read, or as it was written."""
    corrected = folder / file.name
    try:
        record = correction_record(corrected)
        written = hash_of(read_bytes(corrected))
    except InputError:
        yield "the corrected program"
        return
    if record is None or record.original_sha256 != hash_of(file.original):
        yield "the program"
    if record is not None and record.corrected_sha256 != written:
        yield "the corrected program"


def _hash_of(project: Project, name: str | None) -> str | None:
    """Return the hash of a file of the project; None if there is none that can be read."""
    if name is None:
        return None
    try:
        return hash_of(read_bytes(project.path(name)))
    except InputError:
        return None
