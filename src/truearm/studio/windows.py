"""The browser windows that are open on a project: which of them works, and what is sent to one alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final

import viser
from viser._messages import (
    FileTransferPartAck,
    GuiUpdateMessage,
    Message,
    RemoveNotificationMessage,
    SetOrientationMessage,
    SetPositionMessage,
)
from websockets.asyncio.server import ServerConnection

from truearm.engine.base.errors import Rule
from truearm.engine.base.files import read_bytes
from truearm.studio import words
from truearm.studio.gate import Gate
from truearm.studio.uploads import Upload

READ_ONLY: Final = Rule(
    "read-only",
    "warning",
    "another window works on the project; this one reads until you press *Take over*; what is changed in it is set "
    "back",
)


class Windows:
    """All see the same; one works, and the others offer to take over.

    Args:
        gate: Knows which one works; it is told of windows that come and go.
    """

    def __init__(self, server: viser.ViserServer, gate: Gate) -> None:
        self._server, self._gate = server, gate
        self._open: dict[int, tuple[viser.ClientHandle, ServerConnection]] = {}
        self.banners: dict[int, list[Any]] = {}
        gate.blocked = self._say_blocked
        gate.uploads.told = self._say_came
        server.on_client_connect(self._arrived)
        server.on_client_disconnect(self._gone)

    # What is sent to the one that works --------------------------------------------------------------------------

    def notify(self, text: str) -> None:
        """Let a refusal come up over the window that works, for some seconds."""
        for client in self._working():
            client.add_notification("Refused", text, color="red", auto_close_seconds=20)

    def show_once(self, title: str, texts: Sequence[str]) -> None:
        """Show something to the window that works, and nowhere else: it is not kept, and not among the notices."""
        for client in self._working():
            modal = client.gui.add_modal(title)
            with modal:
                client.gui.add_html(words.lines(texts))
                client.gui.add_button("Close").on_click(lambda _, modal=modal: modal.close())  # type: ignore[misc]

    def download(self, path: Path) -> None:
        """Send a file to the browser of the window that works."""
        content = read_bytes(path)
        for client in self._working():
            client.send_file_download(path.name, content, save_immediately=True)

    def _working(self) -> list[viser.ClientHandle]:
        return [client for client, connection in [*self._open.values()] if self._gate.is_working(connection)]

    # Who works ---------------------------------------------------------------------------------------------------

    def _arrived(self, client: viser.ClientHandle) -> None:
        connection = self._server._websock_server._live_connections.get(client.client_id)
        if connection is None:
            return
        self._open[client.client_id] = (client, connection)
        self._gate.arrived(connection)
        self._show_who_works()

    def _gone(self, client: viser.ClientHandle) -> None:
        _, connection = self._open.pop(client.client_id, (None, None))
        self.banners.pop(client.client_id, None)
        if connection is not None:
            self._gate.gone(connection)
            self._show_who_works()

    def _show_who_works(self) -> None:
        """Let every window that only reads say so, and offer to take over."""
        for number, (client, connection) in [*self._open.items()]:
            working, shown = self._gate.is_working(connection), number in self.banners
            if working and shown:
                for element in self.banners.pop(number):
                    self._gate.offers.discard(element._impl.uuid)
                    element.remove()
            elif not working and not shown:
                said = client.gui.add_html("", order=-2.0)
                button = client.gui.add_button("Take over", order=-1.0, color="orange")
                self._gate.offers.add(button._impl.uuid)
                button.on_click(partial(self._take_over, connection))
                self.banners[number] = [said, button]
        who = "Another window works on this project" if self._gate.has_worker else "No window works on this project now"
        text = words.notice(READ_ONLY(f"{who}; this one only reads."))
        for said, _ in [*self.banners.values()]:
            said.content = text

    def _take_over(self, connection: ServerConnection, _: Any) -> None:
        self._gate.take_over(connection)
        self._show_who_works()

    # What the gate says to one window ----------------------------------------------------------------------------

    def _say_blocked(self, connection: ServerConnection, why: str, message: Mapping[str, Any]) -> None:
        """Tell a window what was refused, and let the element that it changed show again what holds."""
        for client, mine in [*self._open.values()]:
            if mine is connection:
                client.add_notification("Refused", why, color="orange", auto_close_seconds=10)
                for back in self._as_they_are(message):
                    client.gui._websock_interface.queue_message(back)

    def _as_they_are(self, message: Mapping[str, Any]) -> Iterator[Message]:
        """Go through the messages that undo in one window what a message to the server has changed there."""
        element = self._server.gui._gui_input_handle_from_uuid.get(str(message.get("uuid")))
        if element is not None and not element._impl.is_button:
            yield GuiUpdateMessage(element._impl.uuid, {"value": element.value})
        handle = self._server.scene._handle_from_node_name.get(str(message.get("name")))
        if handle is not None:
            yield SetPositionMessage(handle.name, tuple(handle.position.tolist()))
            yield SetOrientationMessage(handle.name, tuple(handle.wxyz.tolist()))

    def _say_came(self, connection: object, number: str, element: str, upload: Upload | None) -> None:
        """Tell a window how much of its file has come; None lets it forget the file."""
        came, size = (0, 0) if upload is None else (upload.came, upload.size)
        for client, mine in [*self._open.values()]:
            if mine is connection:
                line = client.gui._websock_interface
                line.queue_message(FileTransferPartAck(element, number, came, size))
                if upload is None:
                    line.queue_message(RemoveNotificationMessage(f"upload-{number}"))
