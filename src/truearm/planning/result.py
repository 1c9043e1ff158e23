"""Which configurations to measure, and what comes of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from truearm.engine.base.errors import InputError, Notice
from truearm.engine.base.writing import output_file, output_folder, write_files
from truearm.engine.document.records import Record, joints_lines, notice_lines, notice_summaries
from truearm.engine.motion.tour import Tour, sheet_beside, tour_csv, tour_summary, tour_words, ways_beside
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import JointsOf
from truearm.engine.robot.library.wider_limits import wider_limits_notices
from truearm.planning.accuracy import There
from truearm.planning.choosing import ERROR, MeasurementPlan, plan_csv
from truearm.planning.plan_program import PLAN_PAGE, SHEET, TABLE, WAYS, PlanProgram

#: What the page beside a plan ends with.
PAGE: Final = ".html"


@dataclass(frozen=True, eq=False, repr=False)
class Plan(Record):
    """Configurations to measure for a calibration, in measuring order."""

    made: MeasurementPlan  #: What was chosen, among what, and how accurate the calibration will be.
    command: str  #: How to run it again.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.
    noise: float = 1e-4  #: Standard deviation of a coordinate about the model that was assumed [m].
    #: Whose joint positions the file holds: the ``model``'s, or those that the ``controller`` shows.
    joints_are: JointsOf = "model"
    accurate_at: str = ""  #: Where the robot shall be accurate, in words; empty for everywhere.
    tour: Tour | None = None  #: How the configurations are driven, each way checked; None where nothing was checked.
    program: PlanProgram | None = None  #: What drives it; None where no program was asked for.
    replaced: tuple[Notice, ...] = ()  #: What to know of another plan that it was written over.
    told: tuple[Notice, ...] = ()  #: What to know of what it was made with: the load, and targets that nobody said.
    hashes: Mapping[str, str] = field(default_factory=dict)  #: SHA-256 of the files that were read, by parameter.

    @property
    def joints(self) -> Array:
        """Where to measure, by the model [rad; m for prismatic joints], ``(n, joints)``."""
        return self.made.joints

    @property
    def labels(self) -> tuple[str, ...]:
        """Name of each configuration."""
        return self.made.labels

    @property
    def chosen_by(self) -> str:
        """What was made large or small by the choice, in words."""
        return f"the error {self.accurate_at}" if self.made.objective == ERROR else self.made.objective

    @property
    def answer(self) -> tuple[str, ...]:
        """How accurate the calibration will be and how many poses it needs, in words."""
        return (*self._there, *self._everywhere)

    @property
    def driving(self) -> tuple[str, ...]:
        """How the configurations are driven, in words; nothing where no way was checked."""
        if self.tour is None:
            return ()
        words = tuple(tour_words(self.tour, self.made.robot, self.joints_are))
        return (*words, "The fixtures of the device are not kept clear of.") if self.made.fixtures else words

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What to know of what it was made with, of the ways that were checked, and of the program."""
        if self.program is not None:
            return self.program.warnings
        robot = self.made.robot
        return (*self.told, *(() if self.tour is None else self.tour.notices), *wider_limits_notices(robot))

    @property
    def _there(self) -> tuple[str, ...]:
        """How accurate the robot will be where it shall be, in words."""
        from truearm.engine.document.drawing import significant

        there = self.made.prediction.there
        if there is None:
            return ()
        mean, most = (significant(1e3 * value, 3) for value in (there.error.mean(), there.error.max()))
        told = f"The model itself will be off by {mean} mm on average {self.accurate_at}, at most by {most} mm."
        if there.by_o1 is None:
            return (told,)
        return (
            told,
            f"As many configurations chosen by O1 would leave {significant(1e3 * there.by_o1.mean(), 3)} mm there.",
        )

    @property
    def _everywhere(self) -> tuple[str, ...]:
        from truearm.engine.document.drawing import significant

        prediction = self.made.prediction
        planned, floor = (significant(value * 1e3, 3) for value in (prediction.planned, prediction.floor))
        first = (
            f"Measured at these {len(self.joints)} configurations, the {self.made.model.name} model will miss readings "
            f"elsewhere by {planned} mm on average. No number of poses brings that below {floor} mm, the noise."
        )
        assumed = (
            f"That assumes that a coordinate of a reading is off by {significant(self.noise * 1e3, 3)} mm about the "
            "model, by the instrument and by what the model cannot follow; give `noise` where you know better."
        )
        if prediction.sufficient_number is None and prediction.tells_little:
            little = (
                f"Before a calibration the robot misses them by about {significant(prediction.nominal * 1e3, 3)} mm, "
                "by the priors of its parameters: these configurations tell little of it. Take more, or widen the "
                "limits that keep them together."
            )
            return first, little, assumed
        if prediction.sufficient_number is None:
            return first, "More poses than were looked at are needed to come within 10 % of that.", assumed
        enough = f"{prediction.sufficient_number} well-chosen poses are enough to come within 10 % of that."
        return first, enough, assumed

    def summary(self) -> dict[str, Any]:
        """Return the figures as JSON holds them: errors in mm."""
        made, prediction = self.made, self.made.prediction
        return {
            "poses": len(made.joints),
            "objective": made.objective,
            "joints_are": self.joints_are,
            "indices": dict(made.indices),
            "candidates": made.candidates,
            "usable": made.usable,
            "rejected": dict(made.rejected),
            "left_out": list(made.left_out),
            "warnings": notice_summaries((*self.warnings, *self.replaced)),
            **({} if self.tour is None else {"ways": tour_summary(self.tour, made.robot, self.joints_are)}),
            **({"fixtures_mm": {n: (1e3 * p).tolist() for n, p in made.fixtures.items()}} if made.fixtures else {}),
            "seconds": made.seconds,
            **({} if self.program is None else {"program": self.program.summary()}),
            "prediction": {
                "floor_mm": prediction.floor * 1e3,
                "planned_mm": prediction.planned * 1e3,
                "enough": prediction.sufficient_number,
                "nominal_mm": prediction.nominal * 1e3,
                **({} if prediction.there is None else {"there": self._there_summary(prediction.there)}),
                "by_number": [
                    {"poses": int(n), "chosen_mm": c * 1e3, "random_mm": r * 1e3}
                    for n, c, r in zip(
                        prediction.numbers, prediction.chosen.tolist(), prediction.random.tolist(), strict=True
                    )
                ],
            },
        }

    def _there_summary(self, there: There) -> dict[str, Any]:
        return {
            "accurate_at": self.accurate_at,
            "places": len(there.error),
            "mean_mm": 1e3 * float(there.error.mean()),
            "max_mm": 1e3 * float(there.error.max()),
            "by_O1_mean_mm": None if there.by_o1 is None else 1e3 * float(there.by_o1.mean()),
        }

    def lines(self) -> list[str]:
        """Return what was chosen, what constraints cost, and how accurate the calibration will be."""
        made = self.made
        text = [f"{len(made.joints)} of {made.usable} usable configurations, chosen by {self.chosen_by}."]
        text += [f"  {name}: broken by {lost} of {made.candidates}" for name, lost in made.rejected.items() if lost]
        text.append("  " + "  ".join(f"{name} {value:.4g}" for name, value in made.indices.items()))
        for name, place in made.fixtures.items():
            text.append(f"  {name} at ({', '.join(f'{v * 1e3:.1f}' for v in place)}) mm in the base frame")
        answer = () if self.program is None else self.program.answer
        driven = [*answer, *notice_lines((*self.warnings, *self.replaced))]
        return [*text, *self.driving, *self.answer, *joints_lines(self.joints_are), *driven]

    def contents(self) -> dict[str, str]:
        """Return the texts of all files of a plan with a program, by their names."""
        from truearm.planning.report import plan_html, plan_sheet

        assert self.program is not None
        assert self.tour is not None
        return {
            TABLE: plan_csv(self.made, self.joints_are),
            PLAN_PAGE: plan_html(self),
            WAYS: tour_csv(self.tour, self.made.robot, self.joints_are),
            SHEET: plan_sheet(self),
            **self.program.files,
        }

    def written_at(self, out: str) -> str:
        """Return the line that says which files hold it."""
        if self.program is not None:
            return f"Written to {out}: {', '.join(self.contents())}"
        file = Path(out)
        ends = [PAGE, *([] if self.tour is None else ["-ways.csv", "-sheet.html"])]
        return f"Written: {file}, {', '.join(str(file.with_name(file.stem + end)) for end in ends)}"

    def save(self, file: str | Path) -> tuple[Path, ...]:
        """Write the plan as CSV, a page with the same name that ends in ``.html``, and a driven one's ways and sheet.

        A plan with a program is written into a folder, with the program and a sheet for the operator.

        Returns:
            The files written; all stops on the ways are in the one that ends in ``-ways.csv``, and ``-sheet.html`` is
            for the operator.
        """
        from truearm.planning.report import plan_html, plan_sheet

        if self.program is not None:
            contents = self.contents()
            folder = output_folder(file, contents, self.inputs, "file", ours=True)
            write_files(folder, contents, self.command, inputs=self.hashes)
            return tuple(folder / name for name in contents)
        table = output_file(file, self.inputs, ours=True)
        if table.suffix == PAGE:
            raise InputError("the plan is a CSV file", parameter="file", came=table.name, allowed="PLAN.csv")
        page = output_file(table.with_suffix(PAGE), self.inputs, ours=True)
        texts = {table.name: plan_csv(self.made, self.joints_are), page.name: plan_html(self)}
        if self.tour is not None:
            ways = output_file(ways_beside(table), self.inputs, ours=True)
            texts[ways.name] = tour_csv(self.tour, self.made.robot, self.joints_are)
            texts[output_file(sheet_beside(table), self.inputs, ours=True).name] = plan_sheet(self)
        write_files(table.parent, texts, self.command, inputs=self.hashes)
        return tuple(table.parent / name for name in texts)
