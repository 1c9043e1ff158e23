"""A plan of tests by ISO 9283: what is measured, and the files with which it is done."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from truearm.engine.base.errors import Notice, counted, millimetres
from truearm.engine.base.writing import output_folder, write_files
from truearm.engine.document.document import Block, Words, each, say, under
from truearm.engine.document.records import Record
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

    def block(self) -> Words:
        """Return how many there are, and how fast they run, in percent."""
        fast = "every velocity."
        if self.record is not None:
            fast = (
                f"up to {100 * self.share:g} % of the velocity. The faster ones are written when {SLOW_RUN} says that "
                "the slow run is completed."
            )
        return say(
            f"{counted(self.count, 'measuring program')} in {self.language}, at {fast}",
            language=self.language,
            slow_percent=round(100.0 * self.share, 6),
            slow_run_completed=self.record is None,
            files=list(self.files),
        )


@dataclass(frozen=True, eq=False, repr=False)
class Iso9283Plan(Record):
    """Tests of a robot's performance, planned."""

    plan: PerformancePlan  #: What is commanded.
    command: str  #: How to run it again.
    warnings: tuple[Notice, ...] = ()  #: What to know about it.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.
    programs: WrittenPrograms | None = None  #: Measuring programs; None where they were not asked for.
    kept: str = ""  #: What all ways keep clear of, in words; nothing where no cell was stated.

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

    def blocks(self) -> Iterator[Block]:
        """Give what is planned, test by test: lengths in mm, velocities and loads in percent of the rated ones."""
        plan = self.plan
        yield say(
            *self.answer,
            robot=plan.robot.name,
            target=plan.target,
            cube_mm={"centre": (plan.cube.centre * 1e3).tolist(), "side": plan.cube.side * 1e3, "plane": plan.plane},
            rated_load_kg=plan.rated_load,
            rated_velocity_mm_s=plan.rated_velocity * 1e3,
        )
        rows = [
            (", ".join(TESTS[test.id].criteria), TESTS[test.id].name, ", ".join(test.places), how_often(test))
            for test in plan.tests
        ]
        wide = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = ["  ".join(map(str.ljust, row, wide)).rstrip() for row in rows]
        yield each("tests", map(_test, plan.tests, lines))
        if self.programs is not None:
            yield under("programs", [self.programs.block()])

    def contents(self) -> dict[str, str]:
        """Return the texts of all files by their names."""
        from truearm.iso9283.planning.sheet import iso9283_sheet

        texts = {PLAN: plan_text(self.plan), ROBOT: robot_text(self.plan.robot), SHEET: iso9283_sheet(self)}
        if self.programs is not None:
            texts |= self.programs.files
            if self.programs.record is not None:
                texts[SLOW_RUN] = self.programs.record
        return texts

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


def _test(test: PlannedTest, line: str) -> Words:
    return say(
        line,
        criterion=test.id,
        criteria=list(TESTS[test.id].criteria),
        places=list(test.places),
        cycles=test.cycles,
        velocities_percent=[round(v * 100.0, 6) for v in test.velocities],
        loads_percent=[round(v * 100.0, 6) for v in test.loads],
    )


def how_often(test: PlannedTest) -> str:
    """Return in words how often a test is done, and under what."""
    speeds = ", ".join(f"{100 * v:g}" for v in test.velocities)
    loads = ", ".join(f"{100 * v:g}" for v in test.loads)
    often = counted(test.cycles, "cycle")
    if test.id == "compliance":
        return f"{often}, up to {loads} % of the rated load"
    return f"{often}, {speeds} % velocity, {loads} % load"
