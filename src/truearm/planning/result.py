"""Which configurations to measure, and what comes of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from truearm.engine.base.errors import InputError, Notice
from truearm.engine.base.writing import output_file, output_folder, write_files
from truearm.engine.document.document import Block, detail, lines_of, say, under
from truearm.engine.document.records import Record, joints_lines
from truearm.engine.motion.tour import Tour, sheet_beside, tour_csv, tour_summary, tour_words, ways_beside
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import JointsOf
from truearm.engine.robot.effects import EFFECTS
from truearm.engine.robot.library.wider_limits import wider_limits_notices
from truearm.engine.robot.loads import has_weight
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
    def answer(self) -> list[str]:
        """How accurate the calibration will be and how many poses it needs, in words."""
        return lines_of(self._accuracy())

    @property
    def driving(self) -> tuple[str, ...]:
        """How the configurations are driven, in words; nothing where no way was checked."""
        if self.tour is None:
            return ()
        words = tuple(tour_words(self.tour, self.made.robot, self.joints_are))
        return (*words, "The fixtures of the device are not kept clear of.") if self.made.fixtures else words

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What to know of it, and of another plan that it was written over."""
        return (*self.own_notices, *self.replaced)

    @property
    def own_notices(self) -> tuple[Notice, ...]:
        """What to know of what it was made with, of the ways that were checked, and of the program."""
        if self.program is not None:
            return self.program.warnings
        robot = self.made.robot
        return (*self.told, *(() if self.tour is None else self.tour.notices), *wider_limits_notices(robot))

    def blocks(self) -> Iterator[Block]:
        """Give what was chosen, what constraints cost, and how accurate the calibration will be, in mm and deg."""
        plan = self.made
        yield say(
            f"{len(plan.joints)} of {plan.usable} usable configurations, chosen by {self.chosen_by}.",
            poses=len(plan.joints),
            objective=plan.objective,
            candidates=plan.candidates,
            usable=plan.usable,
            left_out=list(plan.left_out),
            seconds=plan.seconds,
        )
        broken = (f"  {name}: broken by {lost} of {plan.candidates}" for name, lost in plan.rejected.items() if lost)
        yield detail(*broken, rejected=dict(plan.rejected))
        yield detail(
            "  " + "  ".join(f"{name} {value:.4g}" for name, value in plan.indices.items()), indices=dict(plan.indices)
        )
        if plan.fixtures:
            places = {name: (1e3 * place).tolist() for name, place in plan.fixtures.items()}
            at = {name: ", ".join(f"{v:.1f}" for v in place) for name, place in places.items()}
            yield detail(*(f"  {name} at ({v}) mm in the base frame" for name, v in at.items()), fixtures_mm=places)
        if self.tour is not None:
            yield detail(*self.driving, ways=tour_summary(self.tour, plan.robot, self.joints_are))
        yield under("prediction", self._accuracy())
        yield detail(*joints_lines(self.joints_are), joints_are=self.joints_are)
        if self.program is not None:
            yield under("program", self.program.blocks())

    def _accuracy(self) -> Iterator[Block]:
        """Give how accurate the robot will be where it shall be, and everywhere, in mm."""
        from truearm.engine.document.drawing import significant

        prediction = self.made.prediction
        if prediction.there is not None:
            yield under("there", self._wanted_accuracy(prediction.there))
        planned, floor = prediction.planned * 1e3, prediction.floor * 1e3
        yield say(
            f"Measured at these {len(self.joints)} configurations, the {self.made.model.name} model will miss readings "
            f"elsewhere by {significant(planned, 3)} mm on average. No number of poses brings that below "
            f"{significant(floor, 3)} mm, the noise.",
            planned_mm=planned,
            floor_mm=floor,
        )
        nominal, enough = prediction.nominal * 1e3, prediction.sufficient_number
        words = f"{enough} well-chosen poses are enough to come within 10 % of that."
        if enough is None and prediction.tells_little:
            words = (
                f"Before a calibration the robot misses them by about {significant(nominal, 3)} mm, by the priors of "
                "its parameters: these configurations tell little of it. Take more, or widen the limits that keep them "
                "together."
            )
        elif enough is None:
            words = "More poses than were looked at are needed to come within 10 % of that."
        yield say(words, enough=enough, nominal_mm=nominal)
        numbers = zip(prediction.numbers, prediction.chosen.tolist(), prediction.random.tolist(), strict=True)
        yield say(
            f"That assumes that a coordinate of a reading is off by {significant(self.noise * 1e3, 3)} mm about the "
            "model, by the instrument and by what the model cannot follow; give `noise` where you know better."
            f"{self._not_planned}",
            loads_left_out=self._leaves_loads_out,
            by_number=[{"poses": int(n), "chosen_mm": c * 1e3, "random_mm": r * 1e3} for n, c, r in numbers],
        )

    @property
    def _leaves_loads_out(self) -> bool:
        """Whether joints give way under loads that are known, and the model does not follow it."""
        follows = any(effect.loaded for effect in EFFECTS if effect.name in self.made.model.effects)
        return has_weight(self.made.robot) and not follows

    @property
    def _not_planned(self) -> str:
        """What the figures leave out, in words that follow others."""
        name, words = self.made.model.name, ""
        if self._leaves_loads_out:
            words = (
                f" Masses are known, and the {name} model does not follow how far joints give way under them: that is "
                "in no figure, and may be many times as much. Plan with `model=elastic`."
            )
        return f"{words} The model auto of 'truearm calibrate' has more to find than {name}: it is not planned for."

    def _wanted_accuracy(self, accuracy: There) -> Iterator[Block]:
        """Give how accurate the robot will be where it shall be, in mm."""
        from truearm.engine.document.drawing import significant

        mean, most = 1e3 * float(accuracy.error.mean()), 1e3 * float(accuracy.error.max())
        yield say(
            f"The model itself will be off by {significant(mean, 3)} mm on average {self.accurate_at}, at most by "
            f"{significant(most, 3)} mm.",
            accurate_at=self.accurate_at,
            places=len(accuracy.error),
            mean_mm=mean,
            max_mm=most,
        )
        by_o1 = None if accuracy.by_o1 is None else 1e3 * float(accuracy.by_o1.mean())
        if by_o1 is None:
            yield say(by_O1_mean_mm=None)
        else:
            words = f"As many configurations chosen by O1 would leave {significant(by_o1, 3)} mm there."
            yield detail(words, by_O1_mean_mm=by_o1)

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
