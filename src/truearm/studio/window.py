"""The window's frame: its pages, what it says, long actions, and which of several windows works."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final

import viser
from viser._messages import FileTransferPartAck, RemoveNotificationMessage
from websockets.asyncio.server import ServerConnection

from truearm.errors import InputError
from truearm.files import confined_reads, exists, read_bytes
from truearm.library import load_robot
from truearm.modeling.parts import Payload
from truearm.modeling.robot import Robot
from truearm.notices import Notice
from truearm.studio import words
from truearm.studio.gate import Gate
from truearm.studio.page import Page
from truearm.studio.project import Project
from truearm.studio.uploads import Upload
from truearm.studio.values import fits
from truearm.studio.work import Work, unforeseen
from truearm.writing import put_back_old

#: So much of what was said stays to be read.
_TOLD: Final = 40
#: So often the folder is looked at for changes of other programs [s].
_LOOK: Final = 2.0
#: A text is taken when nothing was typed for so long [s].
_REST: Final = 0.6
#: Width of the pages, and width and height of the notices, which float over a corner of the scene [px].
_WIDTH: Final = 520
_NOTICES: Final = (440, 230)


class Window:
    """All windows of one project: they show the same, and one of them works.

    Every change of the project goes through :meth:`action` or :meth:`edit`, one at a time.

    Attributes
    ----------
    project
        The folder.
    gate
        Who may talk.
    server, gui
        viser's; pages add their elements to `gui` inside their tab, and things to ``server.scene``.
    pages
        In the order of the work.
    """

    def __init__(self, project: Project, server: viser.ViserServer, gate: Gate, pages: Sequence[type[Page]]) -> None:
        self.project, self.server, self.gate = project, server, gate
        self.gui = server.gui
        self.lock = threading.RLock()
        self._told: deque[str] = deque(maxlen=_TOLD)
        self._work: Work | None = None
        self._windows: dict[int, tuple[viser.ClientHandle, ServerConnection]] = {}
        self._banners: dict[int, list[Any]] = {}
        self._changes: tuple[Any, ...] = ()
        self._typing: dict[object, tuple[threading.Timer, Callable[[], None]]] = {}
        self._stopped = threading.Event()
        self.pages: list[Page] = []
        self._theme()
        self._frame(pages)
        gate.blocked = self._say_blocked
        gate.uploads.told = self._say_came
        gate.fits = self._fits
        gate.say = lambda text: self.tell(Notice("refused", text.removeprefix("refused: "), "warning"))
        server.on_client_connect(self._arrived)
        server.on_client_disconnect(self._gone)
        self._looking = threading.Thread(target=self._look, daemon=True)
        self._looking.start()

    # What pages use ----------------------------------------------------------------------------------------------

    def action(self, do: Callable[[], None]) -> Callable[[Any], None]:
        """Return a callback for an element: `do` is called under the lock, and a refusal is shown.

        It is called for what a user did alone, not where the studio itself sets a value.
        """

        def called(event: Any) -> None:
            if getattr(event, "client", None) is not None:
                with self.lock:
                    if self._typed(*self._typing):
                        self._do(do)

        return called

    def _do(self, do: Callable[[], None]) -> bool:
        """Do something for the user, and show what is refused; return whether nothing was."""
        with self.lock, confined_reads(self.project.folder):
            try:
                do()
            except InputError as error:
                self.refuse(error)
                self.refresh()
            except Exception as error:  # it is told, and its place is on standard error
                self.refuse(unforeseen(error))
            else:
                return True
        return False

    def receive(self, button: Any, do: Callable[[Upload], None]) -> None:
        """Let a button for uploads take in files: `do` is called as by :meth:`action`, with each that has come whole.

        A file that `do` leaves where it has come is removed.
        """

        def take(upload: Upload) -> None:
            try:
                self._do(lambda: do(upload))
            finally:
                upload.discard()

        def begin(upload: Upload) -> None:
            threading.Thread(target=take, args=(upload,), daemon=True).start()

        self.gate.uploads.takers[button._impl.uuid] = begin

    def settled(self, do: Callable[[], None]) -> Callable[[Any], None]:
        """Return a callback as :meth:`action` does, for a text that somebody types.

        It waits for the typing to rest, or for what is done next: that is done with what was typed, or not at all where
        that is refused.
        """
        key = object()

        def called(event: Any) -> None:
            if getattr(event, "client", None) is None:
                return
            with self.lock:
                if key in self._typing:
                    self._typing.pop(key)[0].cancel()
                timer = threading.Timer(_REST, self._typed, (key,))
                timer.daemon = True
                self._typing[key] = (timer, partial(self._take_typed, event.target, event.target.value, do))
                timer.start()

        return called

    def _take_typed(self, field: Any, text: Any, do: Callable[[], None]) -> None:
        """Do what follows from a text: a field typed in before may have shown all fields anew meanwhile."""
        field.value = text
        do()

    def _typed(self, *keys: object) -> bool:
        """Take what was typed; return whether nothing of it was refused."""
        taken = True
        with self.lock:
            for key in keys:
                timer, do = self._typing.pop(key, (None, None))
                if timer is not None and do is not None:
                    timer.cancel()
                    taken = self._do(do) and taken
        return taken

    def edit(self, files: Mapping[str, str] | None = None, **changes: Any) -> None:
        """Change settings of the project, and small files; pages are shown anew where something changed.

        Raises
        ------
        InputError
            If a value cannot be.
        """
        with self.lock:
            if self.project.edit(files, **changes):
                self.refresh()

    def tell(self, notice: Notice) -> None:
        """Say something in the notices."""
        self._show(words.notice(notice))

    def tell_lines(self, title: str, texts: Sequence[str]) -> None:
        """Show what a command would print, in the notices."""
        self._show(words.paragraph(title) + words.lines(texts))

    def refuse(self, error: InputError) -> None:
        """Show a refusal where the user acted, in the words of the job, and in the notices."""
        text = words.refusal(error)
        self.tell(Notice("refused", text, "error"))
        for client, connection in [*self._windows.values()]:
            if self.gate.is_working(connection):
                client.add_notification("Refused", text, color="red", auto_close_seconds=20)

    def show_once(self, title: str, texts: Sequence[str]) -> None:
        """Show something to the window that works, and nowhere else: it is not kept, and not among the notices."""
        for client, connection in [*self._windows.values()]:
            if self.gate.is_working(connection):
                modal = client.gui.add_modal(title)
                with modal:
                    client.gui.add_html(words.lines(texts))
                    client.gui.add_button("Close").on_click(lambda _, modal=modal: modal.close())  # type: ignore[misc]

    def start(
        self,
        title: str,
        do: Callable[..., Any],
        done: Callable[[Any], None],
        told: Callable[[str], None] = lambda _: None,
        **arguments: Any,
    ) -> None:
        """Run a function of :mod:`truearm.studio.tasks` in a process of its own, with progress and cancel.

        Parameters
        ----------
        done
            Called with what it returned, under the lock.
        told
            Called with each word of its progress, under the lock.

        Raises
        ------
        InputError
            If another action still runs.
        """
        with self.lock:
            if self._work is not None:
                raise InputError("another action still runs", cure="Wait for it, or cancel it.")
            self._bar.visible = self._cancel.visible = True
            self._doing.content = words.paragraph(f"{title}: starting")

            def said(text: str) -> None:
                self._doing.content = words.paragraph(f"{title}: {text}")
                with self.lock:
                    told(text)

            def ended(outcome: Any) -> None:
                with self.lock:
                    self._work = None
                    self._bar.visible = self._cancel.visible = False
                    if outcome is None:
                        self._doing.content = words.paragraph(f"{title}: cancelled")
                        for folder in (self.project.folder, self.project.file("result")):
                            if folder is not None and folder.is_dir():
                                put_back_old(folder)
                        self.tell(Notice("cancelled", f"{title} was cancelled; nothing was written.", "note"))
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
                    self.refresh()

            work = self._work = Work(do, arguments, said, ended)

    def download(self, path: Path) -> None:
        """Send a file of the project to the browser of the window that works."""
        content = read_bytes(path)
        for client, connection in [*self._windows.values()]:
            if self.gate.is_working(connection):
                client.send_file_download(path.name, content, save_immediately=True)

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

        Raises
        ------
        InputError
            If it cannot be read.
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
        """Return which robot the result is of, where that is not the robot that is chosen; nothing otherwise."""
        calibrated = self.calibrated()
        return "" if calibrated is None or calibrated.name == self.robot().name else calibrated.name

    def refuse_result_of_another(self) -> None:
        """Refuse to go on with the result of another robot than the one that is chosen.

        Raises
        ------
        InputError
            If it is of another.
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
        with self.lock, confined_reads(self.project.folder):
            settings = self.project.settings
            self._where.content = words.paragraph(f"{self.project.folder}")
            if self._dark != settings.dark:
                self._theme()
            for page in self.pages:
                try:
                    page.refresh()
                except InputError as error:
                    self.tell(Notice("refused", f"{page.title}: {words.refusal(error)}", "error"))

    def stop(self) -> None:
        """End the long action and the server."""
        self._stopped.set()
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
        self._changed = gui.add_html("", visible=False)
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
        self.project.undo()
        self.refresh()

    def _redo_edit(self) -> None:
        self.project.redo()
        self.refresh()

    def _reload(self) -> None:
        self.project.reload()
        self._changes = ()
        self._changed.visible = False
        self.refresh()

    def _cancelled(self) -> None:
        if self._work is not None:
            self._work.cancel()

    def _show(self, html: str) -> None:
        self._told.appendleft(f"{words.paragraph(time.strftime('%H:%M:%S'))}{html}")
        self._notices.content = "".join(self._told)

    # Other programs, other windows -------------------------------------------------------------------------------

    def _look(self) -> None:
        """Tell of files that other programs change, as long as the window is there."""
        while not self._stopped.wait(_LOOK):
            with self.lock:
                if self._work is not None:
                    continue
                changes = self.project.changes()
                if changes == self._changes:
                    continue
                self._changes = changes
                told = ", ".join(f"{one.name} ({one.how})" for one in changes[:8])
                more = f" and {len(changes) - 8} more" if len(changes) > 8 else ""
                text = f"Another program has changed files: {told}{more}. Press reload to see them as they are now."
                self._changed.content = words.notice(Notice("files-changed", text, "warning"))
                self._changed.visible = bool(changes)

    def _arrived(self, client: viser.ClientHandle) -> None:
        connection = self.server._websock_server._live_connections.get(client.client_id)
        if connection is None:
            return
        self._windows[client.client_id] = (client, connection)
        self.gate.arrived(connection)
        self._show_who_works()

    def _gone(self, client: viser.ClientHandle) -> None:
        _, connection = self._windows.pop(client.client_id, (None, None))
        self._banners.pop(client.client_id, None)
        if connection is not None:
            self.gate.gone(connection)

    def _show_who_works(self) -> None:
        """Let every window that only reads say so, and offer to take over."""
        for number, (client, connection) in [*self._windows.items()]:
            working, shown = self.gate.is_working(connection), number in self._banners
            if working and shown:
                for element in self._banners.pop(number):
                    self.gate.offers.discard(element._impl.uuid)
                    element.remove()
            elif not working and not shown:
                text = Notice("read-only", "Another window works on this project; this one only reads.", "warning")
                said = client.gui.add_html(words.notice(text), order=-2.0)
                button = client.gui.add_button("Take over", order=-1.0, color="orange")
                self.gate.offers.add(button._impl.uuid)
                button.on_click(partial(self._take_over, connection))
                self._banners[number] = [said, button]

    def _take_over(self, connection: ServerConnection, _: Any) -> None:
        self.gate.take_over(connection)
        self._show_who_works()

    def _say_blocked(self, connection: ServerConnection, why: str) -> None:
        for client, mine in [*self._windows.values()]:
            if mine is connection:
                client.add_notification("Refused", why, color="orange", auto_close_seconds=10)

    def _fits(self, number: str, value: object) -> bool:
        element = self.gui._gui_input_handle_from_uuid.get(number)
        return element is None or fits(element, value)  # viser drops what is for an element that is gone

    def _say_came(self, connection: object, number: str, element: str, upload: Upload | None) -> None:
        """Tell a window how much of its file has come; None lets it forget the file."""
        came, size = (0, 0) if upload is None else (upload.came, upload.size)
        for client, mine in [*self._windows.values()]:
            if mine is connection:
                line = client.gui._websock_interface
                line.queue_message(FileTransferPartAck(element, number, came, size))
                if upload is None:
                    line.queue_message(RemoveNotificationMessage(f"upload-{number}"))
