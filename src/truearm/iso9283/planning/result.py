"""A plan of tests by ISO 9283: what is measured, and the files with which it is done."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from truearm.engine.base.errors import Notice, counted, millimetres
from truearm.engine.base.writing import output_folder, write_files
from truearm.engine.document.records import Record, notice_lines, notice_summaries
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.iso9283.planning.criteria import TESTS, PerformancePlan, PlannedTest
from truearm.iso9283.planning.plan_file import PLAN, ROBOT, plan_text
from truearm.iso9283.planning.routes import SLOW_RUN

#: What the operator takes along.
SHEET: Final = "sheet.html"
PLAN_FILES: Final = (PLAN, ROBOT, SHEET)


@dataclass(frozen=True, eq=False)
class WrittenPrograms:
    """Measuring programs of a plan."""

    language: str  #: Its name.
    files: Mapping[str, str]  #: Texts by their names in the plan's folder.
    record: str | None  #: Text of the record of the slow run, still to be done; None where one was given.
    count: int  #: How many programs they are.
    share: float  #: Velocity of the slow run, in that of the robot; that of single tests may be lower.


@dataclass(frozen=True, eq=False, repr=False)
class Iso9283Plan(Record):
    """Tests of a robot's performance, planned."""

    plan: PerformancePlan  #: What is commanded.
    command: str  #: How to run it again.
    warnings: tuple[Notice, ...] = ()  #: What to know about it.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.
    programs: WrittenPrograms | None = None  #: Measuring programs; None where they were not asked for.
    kept: str = ""  #: What all ways keep clear of, in words; nothing where no cell was stated.

    def summary(self) -> dict[str, Any]:
        """Return the plan as JSON holds it: lengths in mm, velocities and loads in percent of the rated ones."""
        plan = self.plan
        return {
            "robot": plan.robot.name,
            "target": plan.target,
            "cube_mm": {"centre": (plan.cube.centre * 1e3).tolist(), "side": plan.cube.side * 1e3, "plane": plan.plane},
            "rated_load_kg": plan.rated_load,
            "rated_velocity_mm_s": plan.rated_velocity * 1e3,
            "tests": [
                {
                    "criterion": test.id,
                    "criteria": list(TESTS[test.id].criteria),
                    "places": list(test.places),
                    "cycles": test.cycles,
                    "velocities_percent": [round(v * 100.0, 6) for v in test.velocities],
                    "loads_percent": [round(v * 100.0, 6) for v in test.loads],
                }
                for test in plan.tests
            ],
            **({} if self.programs is None else {"programs": _of_programs(self.programs)}),
            "warnings": notice_summaries(self.warnings),
        }

    @property
    def answer(self) -> list[str]:
        """What is planned, in words."""
        plan = self.plan
        centre = ", ".join(millimetres(value) for value in plan.cube.centre)
        return [
            f"{counted(len(plan.tests), 'test')} of {plan.robot.title}, plane {plan.plane} of the cube of "
            f"{millimetres(plan.cube.side)} mm about ({centre}) mm.",
            f"Rated: {plan.rated_load:g} kg, {millimetres(plan.rated_velocity)} mm/s along a path.",
            *([self.kept] if self.kept else []),
        ]

    def lines(self) -> list[str]:
        """Return what is planned, test by test."""
        rows = [
            (", ".join(TESTS[test.id].criteria), TESTS[test.id].name, ", ".join(test.places), how_often(test))
            for test in self.plan.tests
        ]
        wide = [max(len(row[k]) for row in rows) for k in range(3)]
        table = ["  ".join([*(row[k].ljust(wide[k]) for k in range(3)), row[3]]).rstrip() for row in rows]
        return [*self.answer, *table, *self._program_lines(), *notice_lines(self.warnings)]

    def _program_lines(self) -> list[str]:
        programs = self.programs
        if programs is None:
            return []
        written = f"{counted(programs.count, 'measuring program')} in {programs.language}"
        if programs.record is None:
            return [f"{written}, at every velocity."]
        return [
            f"{written}, at up to {100 * programs.share:g} % of the velocity. The faster ones are written when "
            f"{SLOW_RUN} says that the slow run is completed."
        ]

    def contents(self) -> dict[str, str]:
        """Return the texts of all files by their names."""
        from truearm.iso9283.planning.sheet import iso9283_sheet

        found = {PLAN: plan_text(self.plan), ROBOT: robot_text(self.plan.robot), SHEET: iso9283_sheet(self)}
        if self.programs is not None:
            found |= self.programs.files
            if self.programs.record is not None:
                found[SLOW_RUN] = self.programs.record
        return found

    @property
    def written(self) -> list[str]:
        """Names of all files; all programs as the folder that they are in."""
        return list(dict.fromkeys(name.partition("/")[0] for name in self.contents()))

    def save(self, folder: str | Path) -> tuple[Path, ...]:
        """Write all files into a folder; return them."""
        contents = self.contents()
        out = output_folder(folder, contents, self.inputs, "folder", ours=True)
        write_files(out, contents, self.command)
        return tuple(out / name for name in contents)


def _of_programs(programs: WrittenPrograms) -> dict[str, Any]:
    return {
        "language": programs.language,
        "slow_percent": round(100.0 * programs.share, 6),
        "slow_run_completed": programs.record is None,
        "files": list(programs.files),
    }


def how_often(test: PlannedTest) -> str:
    """Return in words how often a test is done, and under what."""
    speeds = ", ".join(f"{100 * v:g}" for v in test.velocities)
    loads = ", ".join(f"{100 * v:g}" for v in test.loads)
    often = counted(test.cycles, "cycle")
    if test.id == "compliance":
        return f"{often}, up to {loads} % of the rated load"
    return f"{often}, {speeds} % velocity, {loads} % load"
