"""The window's frame: its pages, what is done on them, what is said and refused, and long actions."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Final, Protocol

import viser

from truearm.engine.base.errors import InputError, Notice, Rule
from truearm.engine.base.files import confined_reads, exists
from truearm.engine.base.writing import put_back_old
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot, fitted_from
from truearm.studio import words
from truearm.studio.gate import Gate
from truearm.studio.other_programs import OtherPrograms
from truearm.studio.project import Project
from truearm.studio.refusals import Refusals
from truearm.studio.typing_at_rest import TypingAtRest
from truearm.studio.uploads import Upload
from truearm.studio.values import fits
from truearm.studio.windows import Windows
from truearm.studio.work import Work, unforeseen

#: So much of what was said stays to be read.
_TOLD: Final = 40
#: Width of the pages, and width and height of the notices, which float over a corner of the scene [px].
_WIDTH: Final = 520
_NOTICES: Final = (440, 230)


REFUSED: Final = Rule(
    "refused",
    ("error", "warning"),
    "a job refused what it was given (error); a request from elsewhere was turned away (warning)",
)
CANCELLED: Final = Rule("cancelled", "note", "a long action was cancelled, and nothing was written")


class Page(Protocol):
    """One page: a tab of the window.

    Its ``__init__`` is called once inside its tab, and adds its elements with ``window.gui``. Its callbacks are made
    with :meth:`Window.action`, so that a refusal is shown where the user acted.
    """

    title: ClassVar[str]

    def __init__(self, window: Window) -> None: ...

    def refresh(self) -> None:
        """Show what is true now: the settings, a file or a result has changed."""


class Window:
    """All windows of one project: they show the same, and one of them works.

    Every change of the project goes through :meth:`action` or :meth:`edit`, one at a time.

    Attributes:
        project: The folder.
        gate: Who may talk.
        server, gui: viser's; pages add their elements to `gui` inside their tab, and things to ``server.scene``.
        pages: In the order of the work.
    """

    def __init__(self, project: Project, server: viser.ViserServer, gate: Gate, pages: Sequence[type[Page]]) -> None:
        self.project, self.server, self.gate = project, server, gate
        self.gui = server.gui
        self.lock = threading.RLock()
        self._told: deque[str] = deque(maxlen=_TOLD)
        self._work: Work | None = None
        self._acted: Any = None  # the element whose callback is called now
        self._refusals = Refusals(self.gui)
        self._sent: dict[str, str] = {}  # texts, as a window has sent them last, by the number of the element
        self._typing = TypingAtRest(
            self.lock, self._value_of, self._take_typed, lambda field: self._refusals.keep_typed(field, None)
        )
        self._stopped = threading.Event()
        self.pages: list[Page] = []
        self._theme()
        self._frame(pages)
        gate.fits = self._fits
        gate.say = lambda text: self.tell(REFUSED(text.removeprefix("refused: "), "warning"))
        self._windows = Windows(server, gate)
        self._others.start()

    # What pages use ----------------------------------------------------------------------------------------------

    def action(self, do: Callable[[], None]) -> Callable[[Any], None]:
        """Return a callback for an element: `do` is called under the lock, and a refusal is shown below the element.

        It is called for what a user did alone, not where the studio itself sets a value. What the user has chosen
        holds, also where the studio shows the page anew while this waits for the lock.
        """

        def called(event: Any) -> None:
            if getattr(event, "client", None) is not None:
                element = getattr(event, "target", None)
                chosen = self._value_of(element)
                with self.lock:
                    if self._typing.take_all():
                        if element is not None and chosen is not None and element.value != chosen:
                            element.value = chosen
                        self._do(do, element)

        return called

    def settled(self, do: Callable[[], None]) -> Callable[[Any], None]:
        """Return a callback as :meth:`action` does, for a text that somebody types.

        It waits for the typing to rest, or for what is done next: that is done with what was typed, or not at all where
        that is refused. What was refused stays in the field as long as its refusal stands below it.
        """
        return self._typing.settled(do)

    def receive(self, button: Any, do: Callable[[Upload], None]) -> None:
        """Let a button for uploads take in files: `do` is called as by :meth:`action`, with each that has come whole.

        A file that `do` leaves where it has come is removed.
        """

        def take(upload: Upload) -> None:
            try:
                self._do(lambda: do(upload), button)
            finally:
                upload.discard()

        def begin(upload: Upload) -> None:
            threading.Thread(target=take, args=(upload,), daemon=True).start()

        self.gate.uploads.takers[button._impl.uuid] = begin

    def _value_of(self, element: Any) -> Any:
        """Return the value that a window has sent: that of the element may have been shown anew meanwhile."""
        number = getattr(getattr(element, "_impl", None), "uuid", "")
        return self._sent.get(number, getattr(element, "value", None))

    def _do(self, do: Callable[[], None], element: Any, typed: Any = None) -> bool:
        """Do something for the user, and show what is refused below the element; return whether nothing was.

        Args:
            typed: A value of the element that somebody has typed.
        """
        with self.lock, confined_reads(self.project.folder):
            stood, before, self._acted = self._refusals.standing(), self._acted, element
            try:
                do()
            except InputError as error:
                self.refuse(error)
                self._refusals.keep_typed(element, typed)
                self.refresh()
            except Exception as error:  # it is told, and its place is on standard error
                self.refuse(unforeseen(error))
            else:
                if self._refusals.remove(stood):
                    self.refresh()  # fields that showed what was refused
                return True
            finally:
                self._acted = before
        return False

    def _take_typed(self, field: Any, value: Any, do: Callable[[], None]) -> bool:
        """Do what follows from a text: a field typed in before may have shown all fields anew meanwhile."""
        field.value = value
        return self._do(do, field, value)

    def edit(
        self,
        files: Mapping[str, str] | None = None,
        *,
        known: Mapping[str, str | None] | None = None,
        **changes: Any,
    ) -> None:
        """Change settings of the project, and small files; pages are shown anew where something changed.

        Args:
            files, known: As for :meth:`truearm.studio.project.Project.edit`.

        Raises:
            InputError: If a value cannot be.
        """
        with self.lock:
            if self.project.edit(files, known=known, **changes):
                self.refresh()

    def tell(self, notice: Notice) -> None:
        """Say something in the notices."""
        self._show(words.notice(notice))

    def tell_lines(self, title: str, texts: Sequence[str]) -> None:
        """Show what a command would print, in the notices."""
        self._show(words.paragraph(title) + words.lines(texts))

    def refuse(self, error: InputError, element: Any = None) -> None:
        """Show a refusal where the user acted, in the words of the job, and in the notices.

        It stands below the element that is given, or whose callback is called now, until something else is done. Where
        there is none, as for keys, it comes up over the window for some seconds.
        """
        text = words.refusal(error)
        self.tell(REFUSED(text))
        if not self._refusals.put(self._acted if element is None else element, text):
            self._windows.notify(text)

    def show_once(self, title: str, texts: Sequence[str]) -> None:
        """Show something to the window that works, and nowhere else: it is not kept, and not among the notices."""
        self._windows.show_once(title, texts)

    def start(
        self,
        title: str,
        do: Callable[..., Any],
        done: Callable[[Any], None],
        told: Callable[[str], None] = lambda _: None,
        **arguments: Any,
    ) -> None:
        """Run a function of :mod:`truearm.studio.tasks` in a process of its own, with progress and cancel.

        What it refuses in the end is shown below the element whose callback has begun it.

        Args:
            done: Called with what it returned, under the lock.
            told: Called with each word of its progress, under the lock.

        Raises:
            InputError: If another action still runs.
        """
        with self.lock:
            if self._work is not None:
                raise InputError("another action still runs", cure="Wait for it, or cancel it.")
            element = self._acted
            self._bar.visible = self._cancel.visible = True
            self._doing.content = words.paragraph(f"{title}: starting")

            def said(text: str) -> None:
                self._doing.content = words.paragraph(f"{title}: {text}")
                with self.lock:
                    told(text)

            def ended(outcome: Any) -> None:
                with self.lock:
                    self._work, self._acted = None, element
                    self._bar.visible = self._cancel.visible = False
                    if outcome is None:
                        self._doing.content = words.paragraph(f"{title}: cancelled")
                        for folder in (self.project.folder, self.project.file("result")):
                            if folder is not None and folder.is_dir():
                                put_back_old(folder)
                        self.tell(CANCELLED(f"{title} was cancelled; nothing was written."))
                    elif isinstance(outcome, InputError):
                        self._doing.content = words.paragraph(f"{title}: refused")
                        self.refuse(outcome)
                    else:
                        seconds = time.monotonic() - work.began
                        self._doing.content = words.paragraph(f"{title}: done in {seconds:.1f} s")
                        settings = self.project.settings
                        self.project.look(settings.result, settings.corrected)
                        try:
                            done(outcome)
                        except InputError as error:
                            self.refuse(error)
                    self._acted = None
                    self.refresh()

            work = self._work = Work(do, arguments, said, ended)

    def download(self, path: Path) -> None:
        """Send a file of the project to the browser of the window that works."""
        self._windows.download(path)

    @property
    def busy(self) -> bool:
        """Whether a long action runs."""
        return self._work is not None

    @property
    def stopped(self) -> bool:
        """Whether nothing is served any more."""
        return self._stopped.is_set()

    def rest(self, seconds: float) -> None:
        """Do nothing for some time, or until nothing is served any more."""
        self._stopped.wait(seconds)

    def wait(self, seconds: float) -> bool:
        """Wait for the long action to end; return whether it has, for tests."""
        work = self._work
        return work is None or work.wait(seconds)

    def robot(self) -> Robot:
        """Return the nominal robot, with the payload of the settings.

        Raises:
            InputError: If it cannot be read.
        """
        said = self.project.settings.payload
        payload = None if said is None else Payload.of(said, "payload")
        with confined_reads(self.project.folder):
            return load_robot(self.project.robot_source()).with_payload(payload, None)

    def calibrated(self) -> Robot | None:
        """Return the calibrated robot; None if there is none yet."""
        folder = self.project.file("result")
        if folder is None or not exists(folder / "calibrated.yaml"):
            return None
        with confined_reads(self.project.folder):
            return load_robot(folder / "calibrated.yaml")

    def result_of_another(self) -> str:
        """Return which robot the result is of, where that is not the robot that is chosen; nothing otherwise.

        Also a robot of the same name is another one where its file has other kinematics than the result began with.
        """
        calibrated = self.calibrated()
        if calibrated is None:
            return ""
        robot = self.robot()
        if calibrated.name != robot.name:
            return calibrated.name
        return "" if fitted_from(calibrated, robot) else f"{calibrated.name} with other kinematics"

    def refuse_result_of_another(self) -> None:
        """Refuse to go on with the result of another robot than the one that is chosen.

        Raises:
            InputError: If it is of another.
        """
        if other := self.result_of_another():
            raise InputError(
                "the result is of another robot than the one that is chosen",
                parameter="robot",
                where=self.project.settings.result,
                came=other,
                allowed=self.robot().name,
                cure="Calibrate the robot that is chosen, or choose the one of the result.",
            )

    def refresh(self) -> None:
        """Show what is true now on every page."""
        with self.lock, confined_reads(self.project.folder), self.server.atomic():
            changes, all_shown = self.project.changes(), True
            settings = self.project.settings
            self._where.content = words.paragraph(f"{self.project.folder}")
            if self._dark != settings.dark:
                self._theme()
            for page in self.pages:
                try:
                    page.refresh()
                except InputError as error:
                    all_shown = False
                    self.tell(REFUSED(f"{page.title}: {words.refusal(error)}"))
            self._refusals.shown_anew()
            if all_shown:
                self._others.shown(changes)

    def stop(self) -> None:
        """End the long action and the server."""
        self._stopped.set()
        self._others.stop()
        if self._work is not None:
            self._work.cancel()
        self.server.stop()
        self.gate.uploads.stop()

    # The frame ---------------------------------------------------------------------------------------------------

    def _theme(self) -> None:
        self._dark = self.project.settings.dark
        self.gui.configure_theme(dark_mode=self._dark, show_logo=False, show_share_button=False)

    def _frame(self, pages: Sequence[type[Page]]) -> None:
        gui = self.gui
        self._where = gui.add_html("")
        self._buttons = gui.add_button_group("Project", ("undo", "redo", "reload", "light / dark"))
        self._buttons.on_click(self.action(lambda: self._pressed(self._buttons.value)))
        changed = gui.add_html("", visible=False)
        self._others = OtherPrograms(self.project, self.lock, lambda: self.busy, changed, self.tell)
        tabs = gui.add_tab_group()
        for kind in pages:
            with tabs.add_tab(kind.title):
                self.pages.append(kind(self))
        gui.main_panel.dock_right()
        gui.main_panel.set_width(_WIDTH)
        panel = gui.add_panel()
        with panel.add_tab("Notices"):
            self._bar = gui.add_progress_bar(100, animated=True, visible=False)
            self._cancel = gui.add_button("Cancel", visible=False, color="red")
            self._doing = gui.add_html("")
            self._notices = gui.add_html(words.paragraph("Nothing to say yet."))
        self._cancel.on_click(self.action(self._cancelled))
        panel.float(x=15, y=-15, width=_NOTICES[0], height=_NOTICES[1])
        undo = gui.add_command("Undo the last edit of the project", hotkey="Z", modifier="cmd/ctrl")
        redo = gui.add_command("Redo the edit of the project", hotkey="Z", modifier="cmd/ctrl+shift")
        undo.on_trigger(self.action(self._undo_edit))
        redo.on_trigger(self.action(self._redo_edit))
        self.refresh()

    def _pressed(self, name: str) -> None:
        settings = self.project.settings
        {  # type: ignore[no-untyped-call]
            "undo": self._undo_edit,
            "redo": self._redo_edit,
            "reload": self._reload,
            "light / dark": lambda: self.edit(dark=not settings.dark),
        }[name]()

    def _undo_edit(self) -> None:
        changed = self.project.undo()
        self.refresh()
        self._show(words.paragraph(f"Undone: {', '.join(changed)}." if changed else "There is nothing to undo."))

    def _redo_edit(self) -> None:
        changed = self.project.redo()
        self.refresh()
        self._show(words.paragraph(f"Done again: {', '.join(changed)}." if changed else "There is nothing to redo."))

    def _reload(self) -> None:
        self.project.reload()
        self._others.look()
        self.refresh()

    def _cancelled(self) -> None:
        if self._work is not None:
            self._work.cancel()

    def _show(self, html: str) -> None:
        self._told.appendleft(f"{words.paragraph(time.strftime('%H:%M:%S'))}{html}")
        self._notices.content = "".join(self._told)

    def _fits(self, number: str, value: object) -> bool:
        element = self.gui._gui_input_handle_from_uuid.get(number)
        if element is None:
            return True  # viser drops what is for an element that is gone
        can_be = fits(element, value)
        if can_be and isinstance(value, str):
            self._sent[number] = value
        return can_be
