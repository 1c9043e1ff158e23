"""Robot programs, corrected so that the real robot goes where they say."""

from __future__ import annotations

from dataclasses import dataclass
from glob import escape
from pathlib import Path
from typing import Any, ClassVar, Final

from truearm.calibration.result import RESULT_FILES
from truearm.compensation.result import REPORT
from truearm.engine.base.errors import InputError, Rule
from truearm.engine.base.files import exists
from truearm.engine.base.manifest import MANIFEST
from truearm.engine.programs.cell import read_wrenches
from truearm.engine.robot.robot_file.entries import STATED
from truearm.engine.robot.wrench import WRENCH_FRAMES, Wrench
from truearm.studio import words
from truearm.studio.corrected import Corrected, corrected_now, kinematics_files
from truearm.studio.drawn_program import DrawnProgram, corrected_program, read_program
from truearm.studio.pages.fields import NONE, Fields, chosen, offer
from truearm.studio.pages.program_in_space import ProgramInSpace
from truearm.studio.project import stamp_of
from truearm.studio.window import Window

#: Whose axes a force is in where nothing was said.
_BASE: Final = "(base)"
#: What a report is called among the files to download.
_REPORT: Final = "report"
#: What stands in a list where nothing was said.
_UNSAID: Final = "(not said)"
#: Settings that count for the drawing of a program, and for its correction.
_DRAWN: Final = ("robot", "program")
_ASKED: Final = ("cell", "wrench", "wrench_frame", "taught", "controller_kinematics", "accept", "accept_correction")
_CORRECTED: Final = (*_DRAWN, "result", "corrected", *_ASKED)
#: What was taught at the robot, as the job takes it.
_TAUGHT: Final = (
    *("none", "points", "tools", "frames"),
    *("points, tools", "points, frames", "tools, frames", "points, tools, frames"),
)


OTHER_PROGRAM: Final = Rule(
    "other-program", "warning", "the corrected program is of another state of the project, and is not handed out"
)


class ProgramsPage:
    """Chooses a program and corrects it with :func:`truearm.compensate`; both can be downloaded."""

    title: ClassVar[str] = "Programs"

    def __init__(self, window: Window) -> None:
        self._window = window
        gui = window.gui
        self._program = gui.add_dropdown("Program", (NONE,), hint="a file of the project")
        self._cell = gui.add_dropdown("Tools and frames", (NONE,), hint="a file of the schema truearm-cell/1")
        self.force = fields = Fields(window, lambda: window.project.settings.model_dump(), self._push)
        fields.text("wrench", "Process force", "on the tool: 0,0,-80,0,0,1.5 in N and N m; or a file of wrenches")
        fields.choice("wrench_frame", "Force in axes of", WRENCH_FRAMES, "of numbers; a file says its own", none=_BASE)
        self._taught = gui.add_dropdown("Taught", (_UNSAID, *_TAUGHT), hint="what was taught at the robot itself")
        self._kinematics = gui.add_dropdown(
            "Controller has", (_UNSAID, *STATED), hint="with what it turns poses into joint positions; or a file"
        )
        self._accept: Any = gui.add_text("Accept", "", hint="names of what a refusal names, with commas between")
        self._largest: Any = gui.add_text(
            "Largest correction", "", hint="length and angle, such as 95mm,3deg; empty for what the robot explains"
        )
        self._read = gui.add_button("Draw the program")
        self._run = gui.add_button("Correct the program")
        self._space = ProgramInSpace(window)
        self._of = self._told_of = _Of()
        self._corrected: Corrected | None = None
        self._corrected_at: tuple[Any, ...] = ()
        self._stands = gui.add_html("")
        self._downloads = gui.add_button_group("Download", (_REPORT,), visible=False)
        self._said = gui.add_html("")
        self._program.on_update(window.action(lambda: window.edit(program=chosen(self._program))))
        self._cell.on_update(window.action(lambda: window.edit(cell=chosen(self._cell))))
        self._taught.on_update(window.action(self._teach))
        self._kinematics.on_update(
            window.action(lambda: window.edit(controller_kinematics=chosen(self._kinematics, _UNSAID)))
        )
        self._accept.on_update(window.settled(self._accepted))
        self._largest.on_update(
            window.settled(lambda: window.edit(accept_correction=self._largest.value.strip() or None))
        )
        self._read.on_click(window.action(self._show))
        self._run.on_click(window.action(self._correct))
        self._downloads.on_click(window.action(self._download))

    def refresh(self) -> None:
        """Offer the files of the folder, and show the settings."""
        from truearm.engine.programs import LANGUAGES

        window, project, settings = self._window, self._window.project, self._window.project.settings
        suffixes = tuple(suffix for language in LANGUAGES for suffix in language.suffixes)
        written = f"{settings.corrected}/"
        programs = [name for name in project.names(*suffixes) if not name.startswith(written)]
        offer(self._program, programs, settings.program)
        offer(self._cell, project.names(".yaml", ".yml"), settings.cell)
        self.force.refresh()
        offer(self._taught, _TAUGHT, None if settings.taught is None else ", ".join(settings.taught), _UNSAID)
        offer(self._kinematics, (*STATED, *kinematics_files(project)), settings.controller_kinematics, _UNSAID)
        self._accept.value = ", ".join(settings.accept or ())
        self._largest.value = settings.accept_correction or ""
        if self._told_of.differs(window):
            self._said.content, self._told_of = "", _Of()
        if self._of.differs(window):
            self._of = _Of()
            self._space.take(None)
        else:
            self._space.show()
        corrected = self._standing()
        self._downloads.visible = corrected is not None and not corrected.changed
        if corrected is not None:
            offered = (*(file.name for file in corrected.files), _REPORT)
            if self._downloads.options != offered:
                self._downloads.options = offered
        self._stands.content = ""
        if corrected is not None and corrected.changed:
            told = f"{corrected.told} It is not handed out: correct the program again."
            self._stands.content = words.notices([OTHER_PROGRAM(told)])

    def _push(self, name: str, value: Any) -> None:
        """Change what acts on the tool; a text that is no force and no file of forces is refused."""
        changed = self._window.project.settings.model_copy(update={name: value})
        if name == "wrench" and changed.wrench_file is not None:
            read_wrenches(self._window.project.path(changed.wrench_file, "wrench"))
        elif name == "wrench" and value is not None:
            Wrench.of(value)
        self._window.edit(**{name: value})

    def _teach(self) -> None:
        said = chosen(self._taught, _UNSAID)
        self._window.edit(taught=None if said is None else said.split(", "))

    def _accepted(self) -> None:
        names = tuple(name.strip() for name in self._accept.value.split(",") if name.strip())
        self._window.edit(accept=names or None)

    def _show(self) -> None:
        window, settings = self._window, self._window.project.settings
        of = _Of.now(window, _DRAWN)
        window.start(
            "Draw the program",
            read_program,
            lambda drawn: self._take(drawn, of),
            folder=window.project.folder,
            robot=settings.robot,
            program=self._chosen(),
        )

    def _take(self, drawn: DrawnProgram, of: _Of) -> None:
        """Draw a program, as it was when its drawing began."""
        self._of = of
        self._space.take(drawn)

    def _standing(self) -> Corrected | None:
        """Return the correction of the chosen program that stands in the folder, looked at anew where files changed."""
        window, project = self._window, self._window.project
        folder, program = project.file("corrected"), project.file("program")
        written = () if folder is None or program is None else _stamps(folder / program.name)
        beside = () if folder is None else (stamp_of(folder / REPORT), stamp_of(folder / MANIFEST))
        at = (project.settings, _Of.now(window, _CORRECTED), written, beside)
        if at != self._corrected_at:
            self._corrected = corrected_now(project, lambda: (window.calibrated(), window.result_of_another()))
            self._corrected_at = at
        return self._corrected

    def _chosen(self) -> str:
        program = self._window.project.settings.program
        if program is None:
            raise InputError("no program is chosen", parameter="programs", cure="Choose a file of the project.")
        return program

    def _correct(self) -> None:
        window, settings = self._window, self._window.project.settings
        program, of = self._chosen(), _Of.now(window, _CORRECTED)
        self._said.content, self._told_of = "", _Of()
        robot = f"{settings.result}/calibrated.yaml"
        if not exists(window.project.path(robot)):
            raise InputError("there is no calibrated robot yet", parameter="robot", cure="Calibrate first.")
        window.refuse_result_of_another()
        window.start(
            "Correct the program",
            corrected_program,
            lambda drawn: self._done(drawn, of),
            folder=window.project.folder,
            robot=robot,
            program=program,
            out=settings.corrected,
            cell=settings.cell,
            wrench=settings.wrench,
            wrench_frame=settings.wrench_axes,
            taught=settings.taught,
            controller_kinematics=settings.controller_kinematics,
            accept=settings.accept or (),
            accept_correction=settings.accept_correction,
        )

    def _done(self, drawn: DrawnProgram, of: _Of) -> None:
        outcome = drawn.outcome
        assert outcome is not None
        written = f"Written to {self._window.project.settings.corrected}: {', '.join(outcome.files)}"
        self._said.content = words.lines([*outcome.lines, written])
        self._told_of = of
        self._take(drawn, of)

    def _download(self) -> None:
        corrected = self._standing()
        if corrected is None:
            raise InputError("there is no corrected program yet", parameter="corrected", cure="Correct it first.")
        corrected.refuse_other()
        chosen_file = next((file for file in corrected.files if file.name == self._downloads.value), None)
        if chosen_file is not None:
            self._window.download(chosen_file)
        elif corrected.report is not None:
            self._window.download(corrected.report)
        else:
            raise InputError(
                "the report in this folder is of another correction",
                parameter="corrected",
                where=self._window.project.settings.corrected,
                cure="Correct the program again.",
            )


@dataclass(frozen=True)
class _Of:
    """Of which settings and files something is shown: those it was made from, as they were when it was begun."""

    named: tuple[str, ...] = ()  #: The settings that count.
    state: tuple[Any, ...] | None = None  #: What they say, and the files that they name; None where nothing is shown.

    @classmethod
    def now(cls, window: Window, named: tuple[str, ...]) -> _Of:
        """Return it as it is now."""
        project = window.project
        state: list[Any] = []
        for name in named:
            said = getattr(project.settings, name)
            state.append(said)
            if name == "result":
                state += [stamp_of(project.path(f"{said}/{file}")) for file in RESULT_FILES[:2]]
            elif name == "program" and said is not None:
                state += _stamps(project.path(said))
            elif isinstance(said, str) and name != "corrected":
                state.append(stamp_of(project.path(said)))
        return cls(named, tuple(state))

    def differs(self, window: Window) -> bool:
        """Return whether any of it is not as it was."""
        return self.state is not None and self != _Of.now(window, self.named)


def _stamps(program: Path) -> tuple[Any, ...]:
    """Return the stamps of a program and of all files of its name: those that belong to it, and its record."""
    beside = sorted(program.parent.glob(f"{escape(program.stem)}.*")) if exists(program.parent) else []
    return tuple((path.name, stamp_of(path)) for path in beside)
