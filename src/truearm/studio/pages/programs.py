"""Robot programs, corrected so that the real robot goes where they say."""

from __future__ import annotations

from typing import Any, ClassVar, Final

from truearm.errors import InputError
from truearm.files import exists
from truearm.modeling.formats.controller_entry import STATED
from truearm.results.program_correction import REPORT
from truearm.studio import words
from truearm.studio.drawn_program import DrawnProgram, corrected_program, read_program
from truearm.studio.pages.choices import NONE, chosen, offer
from truearm.studio.pages.program_in_space import ProgramInSpace
from truearm.studio.window import Window

#: What stands in a list where nothing was said.
_UNSAID: Final = "(not said)"
#: What was taught at the robot, as the job takes it.
_TAUGHT: Final = ("none", "tools", "frames", "tools, frames")


class ProgramsPage:
    """Chooses a program and corrects it with :func:`truearm.compensate`; both can be downloaded."""

    title: ClassVar[str] = "Programs"

    def __init__(self, window: Window) -> None:
        self._window = window
        gui = window.gui
        self._program = gui.add_dropdown("Program", (NONE,), hint="a file of the project")
        self._cell = gui.add_dropdown("Tools and frames", (NONE,), hint="a file of the schema truearm-cell/1")
        self._taught = gui.add_dropdown("Taught", (_UNSAID, *_TAUGHT), hint="what was taught at the robot itself")
        self._kinematics = gui.add_dropdown(
            "Controller has", (_UNSAID, *STATED), hint="with what the controller turns poses into joint positions"
        )
        self._read = gui.add_button("Draw the program")
        self._run = gui.add_button("Correct the program")
        self._space = ProgramInSpace(window)
        self._of: tuple[Any, ...] = ()
        self._downloads = gui.add_button_group("Download", ("corrected program", "report"), visible=False)
        self._said = gui.add_html("")
        self._program.on_update(window.action(lambda: window.edit(program=chosen(self._program))))
        self._cell.on_update(window.action(lambda: window.edit(cell=chosen(self._cell))))
        self._taught.on_update(window.action(self._teach))
        self._kinematics.on_update(
            window.action(lambda: window.edit(controller_kinematics=chosen(self._kinematics, _UNSAID)))
        )
        self._read.on_click(window.action(self._show))
        self._run.on_click(window.action(self._correct))
        self._downloads.on_click(window.action(self._download))

    def refresh(self) -> None:
        """Offer the files of the folder, and show the settings."""
        from truearm.compensation.programs import LANGUAGES

        project, settings = self._window.project, self._window.project.settings
        suffixes = tuple(suffix for language in LANGUAGES for suffix in language.suffixes)
        written = f"{settings.corrected}/"
        programs = [name for name in project.names(*suffixes) if not name.startswith(written)]
        offer(self._program, programs, settings.program)
        offer(self._cell, project.names(".yaml", ".yml"), settings.cell)
        offer(self._taught, _TAUGHT, None if settings.taught is None else ", ".join(settings.taught), _UNSAID)
        offer(self._kinematics, STATED, settings.controller_kinematics, _UNSAID)
        folder = project.file("corrected")
        self._downloads.visible = folder is not None and exists(folder / REPORT)
        if self._of and self._of != self._now():
            self._of = ()
            self._space.take(None)
        else:
            self._space.show()

    def _teach(self) -> None:
        said = chosen(self._taught, _UNSAID)
        self._window.edit(taught=None if said is None else said.split(", "))

    def _show(self) -> None:
        window, settings = self._window, self._window.project.settings
        window.start(
            "Draw the program",
            read_program,
            self._take,
            folder=window.project.folder,
            robot=settings.robot,
            program=self._chosen(),
        )

    def _take(self, drawn: DrawnProgram) -> None:
        self._of = self._now()
        self._space.take(drawn)

    def _now(self) -> tuple[Any, ...]:
        """Return what is drawn: of which robot and which program, as it is now."""
        project, file = self._window.project, self._window.project.file("program")
        stat = None if file is None or not exists(file) else file.stat()
        return project.settings.robot, project.settings.program, stat and (stat.st_size, stat.st_mtime_ns)

    def _chosen(self) -> str:
        program = self._window.project.settings.program
        if program is None:
            raise InputError("no program is chosen", parameter="programs", cure="Choose a file of the project.")
        return program

    def _correct(self) -> None:
        window, settings = self._window, self._window.project.settings
        program = self._chosen()
        robot = f"{settings.result}/calibrated.yaml"
        if not exists(window.project.path(robot)):
            raise InputError("there is no calibrated robot yet", parameter="robot", cure="Calibrate first.")
        window.refuse_result_of_another()
        window.start(
            "Correct the program",
            corrected_program,
            self._done,
            folder=window.project.folder,
            robot=robot,
            program=program,
            out=settings.corrected,
            cell=settings.cell,
            taught=settings.taught,
            controller_kinematics=settings.controller_kinematics,
        )

    def _done(self, drawn: DrawnProgram) -> None:
        outcome = drawn.outcome
        assert outcome is not None
        written = f"Written to {self._window.project.settings.corrected}: {', '.join(outcome.files)}"
        self._said.content = words.lines([*outcome.lines, written])
        self._take(drawn)

    def _download(self) -> None:
        project, settings = self._window.project, self._window.project.settings
        folder = project.file("corrected")
        if folder is None or settings.program is None:
            return
        name = REPORT if self._downloads.value == "report" else settings.program.rpartition("/")[2]
        self._window.download(folder / name)
