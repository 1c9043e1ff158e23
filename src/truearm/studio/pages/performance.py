"""Tests of performance by ISO 9283: planned, evaluated, as a table and in space."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Any, ClassVar, Final

from truearm.engine.base.errors import InputError, Notice, counted
from truearm.engine.base.files import exists
from truearm.engine.base.units import as_number
from truearm.engine.twin.truths import truth_names
from truearm.iso9283.criteria.rows import Value
from truearm.iso9283.evaluating.comparison import ResultFile, read_result
from truearm.iso9283.evaluating.evaluate import EVALUATION_FILES, REPORT, RESULT
from truearm.iso9283.evaluating.table import (
    HEADING,
    UNITS,
    beside_words,
    conditions_words,
    number_words,
    values_of,
    worst_places,
)
from truearm.iso9283.jobs import PlanTests
from truearm.iso9283.planning.plan_file import PLAN
from truearm.iso9283.simulating.simulate import FILES
from truearm.studio import words
from truearm.studio.evaluated_with import evaluated_with, other_evaluations, stamps_of
from truearm.studio.pages.drawn_cube import DrawnCube
from truearm.studio.pages.fields import NONE, chosen, offer
from truearm.studio.pictures import Picture, report_figures
from truearm.studio.project import stamp_of
from truearm.studio.tasks import Outcome
from truearm.studio.tested import evaluate_tests, plan_tests, simulate_tests
from truearm.studio.window import Window

#: Files that are chosen, with their labels, what they are, and their endings.
_CHOICES: Final = (
    ("plan", "Plan", "plan.yaml of a plan of tests", (".yaml", ".yml")),
    ("poses", "Poses", "poses that were attained", (".csv",)),
    ("paths", "Paths", "samples along paths", (".csv",)),
    ("settling", "Settling", "samples of coming to rest", (".csv",)),
    ("forces", "Forces", "the tip under forces", (".csv",)),
    ("alignment", "Alignment", "how the instrument was tied to the robot's base", (".yaml", ".yml")),
    ("compare", "Compare", "iso9283.json of another result", (".json",)),
)
#: Where a plan is written, and what is simulated for it.
_FOLDER: Final = "iso9283"
_SIMULATED: Final = ("iso9283/simulated", "iso9283/simulated-corrected")
_WORST: Final = "(worst places)"
#: A column of the table that has no room here: those values stand with all others of their criterion.
_OTHERS: Final = "Other velocities"


class PerformancePage:
    """Runs :func:`truearm.iso9283_evaluate`, and shows the result that stands in its folder, whoever wrote it."""

    title: ClassVar[str] = "Performance"

    def __init__(self, window: Window) -> None:
        self._window = window
        gui, files = window.gui, window.project.settings.performance
        self._result_file: ResultFile | None = None
        self._values: tuple[Value, ...] = ()
        self._figures: dict[str, Any] = {}
        self._shown: tuple[Any, ...] = ()
        self._compared: tuple[Any, ...] = ()
        self._said_of: tuple[Any, ...] = ()  # empty for what is of no result
        self._planning()
        self._simulating()
        with gui.add_folder("Evaluate", expand_by_default=True):
            self._choices: dict[str, Any] = {}
            for name, label, hint, _ in _CHOICES:
                self._choices[name] = gui.add_dropdown(label, (NONE,), hint=hint)
                self._choices[name].on_update(window.action(partial(self._choose, name)))
            self._noise: Any = gui.add_number("Noise [mm]", files.noise_mm, min=1e-5, max=10.0, step=0.001)
            self._noise_rot: Any = gui.add_number("Noise [deg]", files.noise_rot_deg, min=1e-5, max=10.0, step=0.001)
            self._result: Any = gui.add_text("Result", files.result, hint="folder of the result")
            self._run = gui.add_button("Evaluate the tests")
        self._of = gui.add_html("")
        self._said = gui.add_html("")
        self._criterion: Any = gui.add_dropdown("Values of", (_WORST,), visible=False)
        self._table = gui.add_html("")
        self._drawn = DrawnCube(window)
        self._picture: Any = gui.add_dropdown("Picture", (NONE,), visible=False)
        self._plot = Picture(window, "Picture")
        self._files: Any = gui.add_button_group("Download", EVALUATION_FILES, visible=False)
        self._noise.on_update(window.settled(lambda: self._change(noise_mm=float(self._noise.value))))
        self._noise_rot.on_update(window.settled(lambda: self._change(noise_rot_deg=float(self._noise_rot.value))))
        self._result.on_update(window.settled(lambda: self._change(result=self._result.value.strip())))
        self._run.on_click(window.action(self._evaluate))
        self._criterion.on_update(window.action(self._show_values))
        self._picture.on_update(window.action(self._draw_picture))
        self._files.on_click(window.action(self._download))

    def _planning(self) -> None:
        gui = self._window.gui
        with gui.add_folder("Plan the tests", expand_by_default=False):
            self._criteria: Any = gui.add_text("Criteria", "ap,rp,at,cr", hint="ids with commas between, or all")
            self._tip: Any = gui.add_vector3("Tip [mm]", (0.0, 0.0, 100.0), step=1.0, hint="in the flange frame")
            self._velocity: Any = gui.add_number("Rated [mm/s]", 1000.0, min=10.0, max=20000.0, step=10.0)
            self._velocities: Any = gui.add_text(
                "Velocities [%]", PlanTests.typed_default("velocities"), hint="percent of the rated velocity"
            )
            self._plan_button = gui.add_button("Plan the tests")
        self._plan_button.on_click(self._window.action(self._plan))

    def _simulating(self) -> None:
        gui = self._window.gui
        with gui.add_folder("Simulate them on a twin", expand_by_default=False):
            self._truth: Any = gui.add_dropdown("Truth", ("random",), hint="what the robot truly is")
            self._seed: Any = gui.add_number("Seed", 1, min=0, step=1)
            self._corrected: Any = gui.add_checkbox(
                "Corrected", False, hint="commands are corrected by the calibrated robot"
            )
            self._simulate_button = gui.add_button("Simulate the tests")
        self._simulate_button.on_click(self._window.action(self._simulate))

    # -- what is shown -------------------------------------------------------------------------------------

    def refresh(self) -> None:
        """Offer the files of the folder, and show the result that stands there."""
        window, project = self._window, self._window.project
        files = project.settings.performance
        for name, _, _, suffixes in _CHOICES:
            found = [one for one in project.names(*suffixes) if name != "compare" or one.endswith(RESULT)]
            offer(self._choices[name], found, getattr(files, name))
        self._noise.value, self._noise_rot.value = files.noise_mm, files.noise_rot_deg
        self._result.value = files.result
        truths = truth_names(window.robot())
        offer(self._truth, truths, self._truth.value if self._truth.value in truths else "random", None)
        place = project.path(files.result) / RESULT
        shown = (place, stamp_of(place), project.settings.dark)
        if shown != self._shown:
            self._show_result(read_result(place) if exists(place) else None)
            self._shown = shown
        compared = (shown, project.settings, stamps_of(project))
        if compared != self._compared:
            self._show_what_it_is_of()
            self._compared = compared
        if self._said_of and self._said_of != shown[:2]:
            self._said.content, self._said_of = "", ()
        self._drawn.refresh()

    def _show_what_it_is_of(self) -> None:
        """Say what the result is of, what of that is not what is chosen now, and what is to know about it."""
        result = self._result_file
        told = other_evaluations(result, self._window.project, self._window.robot())
        if result is not None:
            told += [Notice(warning.code, warning.message, warning.level) for warning in result.warnings]
        of = "" if result is None else words.lines([evaluated_with(result)])
        self._of.content = of + words.notices(told)

    def _show_result(self, result: ResultFile | None) -> None:
        there = result is not None
        self._result_file = result
        self._files.visible = self._criterion.visible = there
        self._values = () if result is None else values_of(result)
        ids = dict.fromkeys(value.id for value in self._values)
        offer(self._criterion, (_WORST, *ids), self._criterion.value if self._criterion.value in ids else _WORST, None)
        self._show_values()
        folder = self._window.project.path(self._window.project.settings.performance.result)
        self._figures = report_figures(folder / REPORT) if there else {}
        self._picture.visible = self._plot.place.visible = bool(self._figures)
        if self._figures:
            first = self._picture.value if self._picture.value in self._figures else next(iter(self._figures))
            offer(self._picture, self._figures, first, None)
            self._draw_picture()

    def _show_values(self) -> None:
        if not self._values:
            self._table.content = words.paragraph("There is no result yet: evaluate what was measured.")
        elif self._criterion.value == _WORST:
            found = "Each at its worst place and fastest velocity, with its 95 % interval or the range of its cycles."
            columns = [k for k, name in enumerate(HEADING) if name != _OTHERS]
            rows = [tuple(_unbroken(worst.cells[k]) for k in columns) for worst in worst_places(self._values)]
            self._table.content = words.paragraph(found) + words.table([HEADING[k] for k in columns], rows)
        else:
            rows = [_cells(value) for value in self._values if value.id == self._criterion.value]
            self._table.content = words.table(("Where", "Under", "Value", "95 %, or range", "Status"), rows)

    def _draw_picture(self) -> None:
        drawn = self._figures.get(self._picture.value)
        if drawn is not None:
            self._plot.show(drawn)

    # -- what a user does ----------------------------------------------------------------------------------

    def _choose(self, name: str) -> None:
        self._change(**{name: chosen(self._choices[name])})

    def _change(self, **files: Any) -> None:
        settings = self._window.project.settings
        self._window.edit(performance={**settings.performance.model_dump(mode="json"), **files})

    def _plan(self) -> None:
        window, tip = self._window, [float(value) / 1e3 for value in self._tip.value]
        window.start(
            "Plan the tests",
            plan_tests,
            self._planned,
            folder=window.project.folder,
            robot=window.project.settings.robot,
            out=_FOLDER,
            criteria=[part.strip() for part in self._criteria.value.split(",")],
            tip=tip if any(tip) else None,
            velocity=float(self._velocity.value) / 1e3,
            velocities=_percents(self._velocities.value),
        )

    def _planned(self, outcome: Outcome) -> None:
        self._told(outcome, _FOLDER)
        self._change(plan=f"{_FOLDER}/{PLAN}")

    def _simulate(self) -> None:
        window, settings = self._window, self._window.project.settings
        corrected = bool(self._corrected.value)
        robot = f"{settings.result}/calibrated.yaml"
        if corrected and not exists(window.project.path(robot)):
            raise InputError("there is no calibrated robot yet", parameter="corrected", cure="Calibrate first.")
        out = _SIMULATED[corrected]
        window.start(
            "Simulate the tests",
            simulate_tests,
            lambda outcome: self._simulated(outcome, out),
            folder=window.project.folder,
            robot=settings.robot,
            plan=self._file("plan"),
            out=out,
            truth=self._truth.value,
            seed=int(self._seed.value),
            corrected=robot if corrected else None,
        )

    def _simulated(self, outcome: Outcome, out: str) -> None:
        self._told(outcome, out)
        self._change(**{n.partition(".")[0]: f"{out}/{n}" if n in outcome.files else None for n in FILES})

    def _evaluate(self) -> None:
        self._said.content, self._said_of = "", ()
        window, files = self._window, self._window.project.settings.performance
        given = {name: getattr(files, name) for name, *_ in _CHOICES if name != "plan"}
        window.start(
            "Evaluate the tests",
            evaluate_tests,
            lambda outcome: self._evaluated(outcome, files.result),
            folder=window.project.folder,
            plan=self._file("plan"),
            out=files.result,
            noise=files.noise_mm / 1e3,
            noise_rot=math.radians(files.noise_rot_deg),
            **given,
        )

    def _evaluated(self, outcome: Outcome, out: str) -> None:
        """Say what the job printed, as long as its result stands there; its notices stand above the table."""
        self._told(replace(outcome, notices=()), out)
        place = self._window.project.path(out) / RESULT
        self._said_of = place, stamp_of(place)

    def _told(self, outcome: Outcome, out: str) -> None:
        """Say what a job printed, and its notices."""
        self._window.project.look(out)
        lines = [line for line in outcome.lines if not any(one.message in line for one in outcome.notices)]
        if not any(line.startswith("Written to ") for line in lines):
            lines.append(f"Written to {out}: {', '.join(outcome.files)}")
        self._said.content, self._said_of = words.lines(lines), ()
        for notice in outcome.notices:
            self._window.tell(notice)

    def _file(self, name: str) -> str:
        found = getattr(self._window.project.settings.performance, name)
        if found is None:
            raise InputError(
                f"no {name} is chosen", parameter=name, cure="Choose a file of the project, or plan first."
            )
        return str(found)

    def _download(self) -> None:
        project = self._window.project
        self._window.download(project.path(f"{project.settings.performance.result}/{self._files.value}"))


def _cells(value: Value) -> tuple[str, ...]:
    """Return the row of a value, as the report has it."""
    number = f"{number_words(value)} {UNITS[value.quantity][0]}" if math.isfinite(value.value) else ""
    where = value.where if value.component == "position" else f"{value.where} {value.component}"
    under = ", ".join(part for part in (conditions_words(value), counted(value.cycles, "cycle")) if part)
    return tuple(map(_unbroken, (where, under, number, beside_words(value), value.status)))


def _unbroken(cell: str) -> str:
    """Return a cell that is broken behind commas and before the count of cycles alone."""
    return ", ".join(part.replace(" ", "\u00a0") for part in cell.split(", ")).replace("\u00a0in\u00a0", " in\u00a0")


def _percents(text: str) -> list[float]:
    numbers = [as_number(part.strip()) for part in text.split(",")]
    known = [number for number in numbers if number is not None]
    if len(known) < len(numbers):
        raise InputError(
            "numbers separated by commas belong here", parameter="velocities", came=text, allowed="percent, as 100,50"
        )
    return known
