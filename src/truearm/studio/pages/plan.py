"""Which configurations to measure: chosen, drawn in space, driven in the scene, and written as a sheet or a program."""

from __future__ import annotations

from contextlib import suppress
from pathlib import PurePosixPath
from typing import Any, ClassVar, Final

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.base.manifest import MANIFEST
from truearm.engine.command.texts import read_poses
from truearm.engine.fit.design import INDICES
from truearm.engine.fit.models import MODELS
from truearm.engine.robot.chain import Array
from truearm.engine.twin.devices import DEVICES
from truearm.planning.choosing import ERROR
from truearm.studio import words
from truearm.studio.arrows import coloured
from truearm.studio.evaluated_with import OTHER_SETTINGS
from truearm.studio.pages.fields import NONE, Fields, offer
from truearm.studio.pages.jog import JogPage
from truearm.studio.pictures import Picture, report_figures
from truearm.studio.plan_made_with import other_plan_told
from truearm.studio.planned import Planned, planned
from truearm.studio.recorded import read_recorded
from truearm.studio.window import Window

#: Of the chosen configurations, of those that were not chosen, and of the ways between them.
_CHOSEN: Final = (214, 69, 61)
_CANDIDATES: Final = (150, 158, 170)
_WAYS: Final = (214, 140, 60)
#: Languages of programs that drive a plan.
_LANGUAGES: Final = ("rapid", "krl", "fanuc", "urscript", "inform", "val3")
_FILES: Final = (".yaml", ".yml")
_NONE_YET: Final = "There is no plan of this window yet."


class PlanPage:
    """Chooses configurations with :func:`truearm.plan`."""

    title: ClassVar[str] = "Plan"

    def __init__(self, window: Window) -> None:
        self._window = window
        self._planned: Planned | None = None
        self._of: tuple[Any, ...] = ()
        self._drawn: tuple[Any, ...] = ()
        self._driven_ways: Array | None = None  # in the world [m], (n, 3)
        gui = window.gui
        self._other = gui.add_html("", visible=False)
        self.fields = fields = Fields(window, self._now, self._change)
        fields.text("poses", "Poses", "how many to choose, or auto")
        fields.choice("model", "Model", [model.name for model in MODELS], "what will be identified", none=None)
        fields.choice("device", "Instrument", [one.name for one in DEVICES], "none: all targets are read everywhere")
        fields.number("noise", "Noise [mm]", "of a coordinate about a well identified model", optional=False)
        fields.number(
            "candidates", "Candidates", "random ones to choose from, without a file", optional=False, whole=True
        )
        fields.file("candidates_from", "Candidates from", (".csv",), "choose among the configurations of a file")
        fields.number("seed", "Seed", "of the random candidates", optional=False, whole=True)
        with gui.add_folder("Where it shall be accurate", expand_by_default=False):
            fields.file("accurate_at", "For", _programs(), "a program, or poses of the flange: .csv")
            fields.text("region", "Region [mm]", "a box for the flange, base frame: 300..600,-200..200,100..400")
            fields.choice("objective", "Objective", (*INDICES, ERROR), "none: O1, or the error where something is said")
        with gui.add_folder("Ways that are clear", expand_by_default=False):
            fields.file("constraints", "Constraints", _FILES, "boxes and more: of the page Cell, or a file")
            fields.number("floor", "Floor [mm]", "its height in the base frame, 0 or less; 0 if not said")
            fields.flag("no_floor", "No floor", "neither a floor nor a surface on which the robot is mounted")
            fields.number("clearance", "Clearance [mm]", "room to floor, boxes and own links; 50 if not said")
            fields.text("home", "Home [deg]", "the safe configuration: 0,-30,30,0,30,0; one is found if not said")
        with gui.add_folder("Measuring program", expand_by_default=False):
            fields.choice("program", "Program", _LANGUAGES, "a program that drives the plan, with a sheet")
            fields.flag("approach", "Approach", "every joint comes to each configuration from one side")
            fields.text("speed", "Speed [mm/s, %]", "highest one of the tip, and of the joints; 250,10 if not said")
            fields.number("dwell", "Dwell [s]", "how long it stands in each configuration; 2 if not said")
            fields.text("wait", "Wait", "what for then: time, operator, or input 3,300s; time if not said")
        fields.text("out", "Write to", "plan.csv if not said; with a program a folder: plan")
        self._run = gui.add_button("Plan")
        self._said = gui.add_html(words.paragraph(_NONE_YET))
        self._enough = Picture(window, "How many poses are enough")
        self._file: Any = gui.add_dropdown("File", (NONE,), visible=False)
        self._download = gui.add_button("Download the file", visible=False)
        with gui.add_folder("In the scene"):
            self._cloud: Any = gui.add_checkbox("Predicted error", True, hint="and the chosen configurations, red")
            self._scale = gui.add_html("", visible=False)
            self._among: Any = gui.add_checkbox(
                "All candidates", False, hint="where the flange is at those that are usable"
            )
            self._line: Any = gui.add_checkbox("Driven ways", True)
            self._speed: Any = gui.add_number("Speed [deg/s, mm/s]", 60.0, min=0.1, max=1000.0, step=1.0)
            self._tour: Any = gui.add_button_group("Ways", ("drive", "stop"))
        self._run.on_click(window.action(self._plan))
        self._cloud.on_update(window.action(self._draw))
        self._among.on_update(window.action(self._draw))
        self._line.on_update(window.action(self._draw_ways))
        self._tour.on_click(window.action(self._driven))
        self._download.on_click(window.action(self._downloaded))

    def refresh(self) -> None:
        """Show the fields of the settings, the plan that stands in the folder, and whether it is of these."""
        self.fields.refresh()
        names = self._written()
        self._file.visible = self._download.visible = bool(names)
        if names:
            value = str(self._file.value)
            offer(self._file, names, value if value in names else names[0], None)
        told = other_plan_told(self._window.project, self._table())
        self._other.visible = bool(told)
        self._other.content = words.notice(OTHER_SETTINGS(told)) if told else ""
        stands = self._stands()
        elsewhere = f"The plan in {stands[0]} was not made in this window: its report says what it is good for."
        self._said.content = words.paragraph(_NONE_YET if stands[1] is None else elsewhere)
        if self._planned is not None and self._of[1:] == stands:
            outcome = self._planned.outcome
            self._said.content = words.lines([*outcome.lines, f"Written: {', '.join(outcome.files)}"])
        seen = self._seen()
        if seen != self._drawn:
            self._drawn = seen
            self._driven_ways = None
            self._draw_ways()
            self._draw()
            enough = report_figures(self._window.project.path(self._report())).get("number")
            self._enough.place.visible = enough is not None
            if enough is not None:
                self._enough.show(enough)

    # The fields --------------------------------------------------------------------------------------------------

    def _now(self) -> dict[str, Any]:
        settings = self._window.project.settings
        return {**settings.plan.model_dump(), "constraints": settings.constraints}

    def _change(self, name: str, value: Any) -> None:
        if name == "constraints":
            self._window.edit(constraints=value)
            return
        if name == "poses":
            read_poses(value or "")  # what it refuses is told where it is typed
        said = self._window.project.settings.plan.model_dump(mode="json")
        self._window.edit(plan={**said, name: value})

    def _plan(self) -> None:
        window, settings = self._window, self._window.project.settings
        window.start(
            "Plan",
            planned,
            lambda found: self._done(found, settings.robot),
            folder=window.project.folder,
            robot=settings.robot,
            fields=settings.plan,
            cell=settings.cell,
            constraints=settings.constraints,
            payload=settings.payload,
        )

    def _done(self, found: Planned, robot: str) -> None:
        table = found.outcome.files[0]
        self._planned, self._of = found, (robot, table, self._stamp(table))
        self._window.project.look(*found.outcome.files, str(PurePosixPath(table).parent / MANIFEST))
        self._drawn = ()

    # The scene ---------------------------------------------------------------------------------------------------

    def _draw(self) -> None:
        scene = self._jog().scene
        self._scale.visible = False
        now = (self._window.project.settings.robot, *self._stands())
        found = self._planned if self._of == now else None
        files = self._written()
        for name in ("predicted", "chosen", "candidates"):
            scene.show_points(name, None)
        if scene.solid is None:
            return
        robot = scene.solid.robot
        base = robot.base  # where the instrument has found it, if it has

        def in_world(points: Array) -> Array:
            return np.asarray(points @ base.rotation.T + base.translation)

        if self._cloud.value:
            if found is not None:
                low, high = float(found.errors.min()), float(found.errors.max())
                told = f"From {1e3 * low:.3g} mm (blue) to {1e3 * high:.3g} mm (yellow); chosen configurations are red."
                self._scale.content, self._scale.visible = words.paragraph(told), True
                scene.show_points("predicted", in_world(found.places), coloured(found.errors, low, high))
                scene.show_points("chosen", in_world(found.chosen), _CHOSEN)
            elif self._table() in files:
                with suppress(InputError):  # the plan may be of another arm
                    joints = read_recorded(self._window.project.path(self._table()), robot).joints
                    scene.show_points("chosen", robot.forward(joints, frame="world")[0], _CHOSEN)
        if self._among.value and found is not None:
            scene.show_points("candidates", in_world(found.candidates), _CANDIDATES, size=0.004)

    def _driven(self) -> None:
        """Play the ways of the plan from its safe configuration, or stop."""
        jog = self._jog()
        if self._tour.value == "stop":
            jog.stop()
            return
        name, written = self._ways(), self._written()
        if name not in written and self._table() in written:
            raise InputError(
                "no ways stand beside this plan",
                where=self._table(),
                cure="Say a clearance, a floor, no floor or home under Ways that are clear, and plan again: of itself "
                "a plan looks for no ways between configurations of a file, which were reached once.",
            )
        if name not in written:
            raise InputError("there are no ways to drive yet", where=name, cure="Plan first.")
        joints = jog.play_file(name, float(self._speed.value), from_its_start=True)
        solid = jog.scene.solid
        if solid is not None:
            self._driven_ways = solid.robot.forward(joints, frame="world")[0]
            self._draw_ways()

    def _draw_ways(self) -> None:
        self._jog().scene.show_line("ways", self._driven_ways if self._line.value else None, _WAYS)

    def _jog(self) -> JogPage:
        return next(page for page in self._window.pages if isinstance(page, JogPage))

    # The files ---------------------------------------------------------------------------------------------------

    def _table(self) -> str:
        plan = self._window.project.settings.plan
        return plan.place if plan.program is None else f"{plan.place}/plan.csv"

    def _report(self) -> str:
        return f"{self._table().removesuffix('.csv')}.html"

    def _ways(self) -> str:
        return f"{self._table().removesuffix('.csv')}-ways.csv"

    def _written(self) -> list[str]:
        """Return the files of the plan: with a program all of their folder."""
        plan, project = self._window.project.settings.plan, self._window.project
        if plan.program is None:
            stem = plan.place.removesuffix(".csv")
            names = [plan.place, f"{stem}.html", self._ways(), f"{stem}-sheet.html"]
            return [name for name in names if project.path(name).is_file()]
        return [name for name in project.names() if name.startswith(f"{plan.place}/")]

    def _stands(self) -> tuple[Any, ...]:
        """Return which plan stands in the folder: the name of its table, and when that was written."""
        return self._table(), self._stamp(self._table())

    def _stamp(self, table: str) -> int | None:
        path = self._window.project.path(table)
        return path.stat().st_mtime_ns if path.is_file() else None

    def _seen(self) -> tuple[Any, ...]:
        """Return what is drawn: of which plan and which robot, and in which colours."""
        scene, dark = self._jog().scene, self._window.project.settings.dark
        return (id(self._planned), self._stands(), dark, None if scene.solid is None else id(scene.solid))

    def _downloaded(self) -> None:
        self._window.download(self._window.project.path(self._file.value))


def _programs() -> tuple[str, ...]:
    from truearm.engine.programs import LANGUAGES

    return (".csv", *(suffix for language in LANGUAGES for suffix in language.suffixes))
