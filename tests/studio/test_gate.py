"""Who may talk to the studio, and what it takes: everything else is refused, said, and harms nothing."""

from __future__ import annotations

import json
import math
import socket
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec
import pytest
import viser
import websockets.asyncio.server
from tests.studio.conftest import Serving
from tests.studio.talking import (
    CAMERA,
    UPGRADE,
    alive,
    element,
    eventually,
    get,
    is_closed,
    messages_of,
    own,
    send,
    shown,
    window,
    working,
)

from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.robot.transform import Transform
from truearm.studio import gate as module
from truearm.studio.access import Access, listening_socket
from truearm.studio.gate import Gate, start_server
from truearm.studio.pages.cell import CellPage
from truearm.studio.pages.jog import JogPage
from truearm.studio.project import PROJECT_FILE
from truearm.studio.serving import Studio
from truearm.studio.uploads import Uploads


def frame(first: int, length: bytes, content: bytes = b"") -> bytes:
    """Return a frame of the web socket protocol, masked with zeros."""
    return bytes([first]) + length + bytes(4) + content


@pytest.mark.parametrize(
    "sent",
    [
        frame(0x82, b"\xff" + (10**9).to_bytes(8, "big"), bytes(200_000)),  # 1 GB announced, sent in part
        frame(0x82, b"\xff" + (2**63 + 5).to_bytes(8, "big")),
        frame(0xF2, b"\x81", b"x"),
        frame(0x83, b"\x81", b"x"),
        b"\x82\x01x",  # not masked
        frame(0x81, b"\x82", b"\xff\xfe"),
        frame(0x89, b"\xfe\xff\xff", bytes(65535)),
    ],
)
def test_malformed_frames_close_their_connection_alone(serving: Serving, sent: bytes) -> None:
    studio = serving()
    lines = "".join(f"{name.replace('_', '-')}: {value}\r\n" for name, value in UPGRADE.items())
    request = f"GET / HTTP/1.1\r\nHost: {own(studio)}\r\nOrigin: http://{own(studio)}\r\n{lines}"
    request += f"Sec-WebSocket-Protocol: viser-v{viser.__version__}\r\n\r\n"
    with window(studio) as other:
        send(other, **CAMERA)
        with socket.create_connection(("127.0.0.1", studio.access.port), timeout=2) as raw:
            raw.sendall(request.encode())
            assert raw.recv(12) == b"HTTP/1.1 101"
            with suppress(ConnectionError, TimeoutError):
                raw.sendall(sent)
                while raw.recv(1 << 16):
                    pass
        send(other, **CAMERA)
        assert len(other.recv(5)) > 0
    assert alive(studio)


@pytest.mark.parametrize(
    "sent",
    [
        "a text",
        b"",
        b"\xc1",
        msgspec.msgpack.encode([1, 2]),
        msgspec.msgpack.encode({"no": "type"}),
        msgspec.msgpack.encode({"type": "ViewerCameraMessage"}),
        msgspec.msgpack.encode({**CAMERA, "more": 1}),
        msgspec.msgpack.encode({**CAMERA, 5: 1}),
        b"\x91" * 200_000,
    ],
)
def test_malformed_messages_close_their_connection_alone(serving: Serving, sent: bytes | str) -> None:
    said: list[str] = []
    studio = serving(say=said.append)
    with window(studio) as line:
        line.send(sent)
        assert is_closed(line)
    assert any(text.startswith("refused: a ") for text in said)
    assert alive(studio)


@pytest.mark.parametrize("kind", ["ShareUrlRequest", "RunJavascriptMessage", "ResetGuiMessage", "Nonsense", "type"])
def test_messages_that_no_window_sends_are_dropped(serving: Serving, kind: str) -> None:
    said: list[str] = []
    studio = serving(say=said.append)
    with window(studio) as line:
        send(line, **CAMERA)
        send(line, type=kind)
        assert eventually(lambda: any(kind in text for text in said))
        send(line, **CAMERA)
    assert alive(studio)


def test_only_the_value_of_an_element_can_be_changed_and_to_one_that_it_offers(serving: Serving) -> None:
    said: list[str] = []
    studio = serving(say=said.append)
    robot = element(studio, CellPage, "Robot")
    with window(studio) as line:
        working(studio, line)
        send(line, type="GuiUpdateMessage", uuid=robot, updates={"removed": True, "update_cb": []})
        assert eventually(lambda: any("otherwise" in text for text in said))
        for value in ("../../etc/passwd", "/etc/passwd", "a\nb", "<script>alert(1)</script>"):
            send(line, type="GuiUpdateMessage", uuid=robot, updates={"value": value})
        send(line, type="GuiUpdateMessage", uuid=robot, updates={"value": "kr5"})
        assert eventually(lambda: studio.window.project.settings.robot == "kr5")
    assert any("an element was to have a value that it cannot have" in text for text in said)
    assert "etc" not in (studio.window.project.folder / PROJECT_FILE).read_text()
    assert alive(studio)


@pytest.mark.parametrize("name", ["../../etc/passwd.csv", "/etc/passwd.csv", "C:\\x.csv", "a\nb.csv", "<script>.exe"])
def test_a_name_that_is_typed_leads_nowhere_and_is_shown_as_it_is(serving: Serving, name: str) -> None:
    studio = serving()
    with window(studio) as line:
        working(studio, line)
        send(line, type="GuiUpdateMessage", uuid=element(studio, JogPage, "File"), updates={"value": name})
        refused = "a table of configurations" if name.endswith("exe") else "no place in the project&#x27;s folder"
        assert eventually(lambda: refused in shown(studio))
    assert "<script>" not in shown(studio)
    assert [path.name for path in studio.window.project.folder.iterdir()] == [PROJECT_FILE]


def test_values_of_no_kind_that_an_element_has_are_refused_and_harm_nothing(
    serving: Serving, capfd: pytest.CaptureFixture[str]
) -> None:
    said: list[str] = []
    studio = serving(say=said.append)
    odd: list[Any] = [
        None,
        -1,
        1e308,
        math.nan,
        "9" * 20_000,
        [],
        [1e3],
        ["a", "b", "c"],
        [math.inf] * 3,
        {"a": 1},
        b"x",
        [[[]]],
    ]
    with window(studio) as line:
        working(studio, line)
        for uuid in [*studio.window.gui._gui_input_handle_from_uuid]:
            for value in odd:
                send(line, type="GuiUpdateMessage", uuid=uuid, updates={"value": value})

        def chosen() -> bool:  # numbers that a job refuses are taken before, and hold this up
            send(line, type="GuiUpdateMessage", uuid=element(studio, CellPage, "Robot"), updates={"value": "kr5"})
            return studio.window.project.settings.robot == "kr5"

        assert eventually(chosen)
        assert alive(studio)
    assert any("an element was to have a value that it cannot have" in text for text in said)
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.parametrize(
    "pose",
    [
        {"wxyz": [math.nan] * 4, "position": [0.0] * 3},
        {"wxyz": [1.0, 0.0, 0.0, 0.0], "position": [math.inf] * 3},
        {"wxyz": [1.0, 0.0], "position": [0.0] * 3},
        {"wxyz": "none", "position": [0.0] * 3},
        {"wxyz": [1.0, 0.0, 0.0, 0.0], "position": [{}, 0.0, 0.0]},
    ],
)
def test_a_handle_cannot_be_dragged_to_what_is_no_pose(serving: Serving, pose: dict[str, Any]) -> None:
    studio = serving()
    with window(studio) as line:
        working(studio, line)
        send(line, type="TransformControlsUpdateMessage", name="/handle", owner="", **pose)
        assert is_closed(line)
    assert alive(studio)


def test_what_nobody_has_foreseen_is_said_where_one_acts(serving: Serving, capfd: pytest.CaptureFixture[str]) -> None:
    studio = serving()

    def fails() -> None:
        raise ZeroDivisionError("by <b>nought</b>")

    studio.window.action(fails)(type("Event", (), {"client": 1}))
    assert "this failed in an unforeseen way (ZeroDivisionError: by &lt;b&gt;nought" in studio.window._notices.content
    assert "Traceback" in capfd.readouterr().err
    assert alive(studio)


def test_a_script_in_the_name_of_a_target_or_fixture_stays_a_name(serving: Serving) -> None:
    studio = serving()
    name = "<img src=x onerror=alert(1)>"
    robot = load_robot("irb120").with_frames(Transform(), {name: (0.0, 0.0, 0.1)})
    robot = robot.with_fixtures({name: ("point", Transform((0.2, 0.0, 0.1)))})
    (studio.window.project.folder / "arm.yaml").write_text(robot_text(robot))
    studio.window.edit(robot="arm.yaml")
    cell = next(page for page in studio.window.pages if isinstance(page, CellPage))
    assert "&lt;img" in cell._about.content
    assert "<img" not in shown(studio)


def test_a_second_window_reads_until_it_takes_over(serving: Serving) -> None:
    studio = serving()
    robot = element(studio, CellPage, "Robot")
    with window(studio) as first, window(studio) as second:
        working(studio, first)
        send(second, **CAMERA)
        assert eventually(lambda: len(studio.window._windows.banners) == 1)
        (offer,) = studio.window.gate.offers
        send(second, type="GuiUpdateMessage", uuid=robot, updates={"value": "kr5"})
        send(second, type="GuiUpdateMessage", uuid=offer, updates={"value": True})
        assert eventually(lambda: offer not in studio.window.gate.offers)
        assert studio.window.project.settings.robot == "irb120"
        assert eventually(lambda: len(studio.window._windows.banners) == 1)  # now the first one reads
        send(first, type="GuiUpdateMessage", uuid=robot, updates={"value": "ur5"})
        send(second, type="GuiUpdateMessage", uuid=robot, updates={"value": "ur10"})
        assert eventually(lambda: studio.window.project.settings.robot == "ur10")
        (banner,) = studio.window._windows.banners.values()
        assert "Another window works" in banner[0].content
        second.close()
        assert eventually(lambda: "No window works on this project now" in banner[0].content)


def test_a_window_that_reads_shows_again_what_holds_and_bothers_nobody(serving: Serving) -> None:
    """What was refused stayed in its fields, and looked true once the window had taken over."""
    said: list[str] = []
    studio = serving(say=said.append)
    handle = studio.window.server.scene.add_transform_controls("/tip", position=(0.1, 0.2, 0.3))
    payload = element(studio, CellPage, "Payload")
    with window(studio) as first, window(studio) as second:
        working(studio, first)
        send(second, **CAMERA)
        assert eventually(lambda: len(studio.window._windows.banners) == 1)
        send(second, type="GuiUpdateMessage", uuid=payload, updates={"value": "9kg,0,0,0"})
        back = messages_of(second, "GuiUpdateMessage", lambda m: m["uuid"] == payload)[-1]
        assert back["updates"] == {"value": ""}
        moved = {"wxyz": [0.0, 1.0, 0.0, 0.0], "position": [1.0, 1.0, 1.0]}
        send(second, type="TransformControlsUpdateMessage", name="/tip", owner="", **moved)
        messages_of(second, "SetPositionMessage", lambda m: m["name"] == "/tip" and m["position"] == [0.1, 0.2, 0.3])
    assert tuple(handle.position) == (0.1, 0.2, 0.3)
    assert not said


def test_the_same_refusal_is_said_once_in_a_second(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    said: list[str] = []
    gate = Gate(Access("127.0.0.1", 1, None, frozenset()), Uploads(tmp_path), said.append)
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    for moment in (0.0, 0.5, 1.5):
        now[0] = moment
        gate._tell("refused: it")
    assert said == ["refused: it"] * 2


# -- what is relied on of viser ------------------------------------------------------------------------------


def test_viser_listens_by_the_one_function_that_is_replaced_and_it_is_put_back(serving: Serving) -> None:
    listen = websockets.asyncio.server.serve
    studio = serving()
    assert websockets.asyncio.server.serve is listen
    (connection,) = [type(one) for one in _connections(studio)]
    assert connection.__name__ == "Watched"


def _connections(studio: Studio) -> list[Any]:
    with window(studio) as line:
        working(studio, line)
        return list(studio.window.server._websock_server._live_connections.values())


def test_a_viser_that_listens_otherwise_serves_nothing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    class Other:
        def __init__(self, **_: Any) -> None:
            self.stopped = False

        def get_port(self) -> int:
            return 1

        def stop(self) -> None:
            self.stopped = True

    monkeypatch.setattr(viser, "ViserServer", Other)
    with listening_socket("127.0.0.1", 0) as bound, pytest.raises(RuntimeError, match="does not listen"):
        start_server(Gate(Access("127.0.0.1", 0, None, frozenset()), Uploads(tmp_path)), bound, "x")


def test_the_port_is_not_moved_by_an_environment_variable(serving: Serving, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("_VISER_PORT_OVERRIDE", "1")
    studio = serving()
    assert studio.window.server.get_port() == studio.access.port
    assert get(studio)[0] == 200


def test_messages_of_windows_have_the_fields_that_are_looked_at() -> None:
    from viser import _messages

    fields = {
        "GuiUpdateMessage": {"uuid", "updates"},
        "FileTransferStartUpload": {
            "transfer_uuid",
            "size_bytes",
            "part_count",
            "filename",
            "source_component_uuid",
        },
        "FileTransferPart": {"transfer_uuid", "content"},
        "FileTransferPartAck": {"source_component_uuid", "transfer_uuid", "transferred_bytes", "total_bytes"},
        "RemoveNotificationMessage": {"uuid"},
    }
    for kind, names in fields.items():
        assert names <= set(getattr(_messages, kind).__dataclass_fields__)
    for kind in module._LOOKING | module._WORKING:
        assert hasattr(_messages, kind)
    assert json.dumps(sorted(module._LOOKING & module._WORKING)) == "[]"


def test_many_windows_at_once_are_served(serving: Serving) -> None:
    studio = serving()
    seen: list[int] = []

    def one() -> None:
        with window(studio) as line:
            send(line, **CAMERA)
            seen.append(len(line.recv(5)))

    threads = [threading.Thread(target=one) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(seen) == 8


def test_every_list_offers_texts_that_are_not_empty_as_others_would_stop_the_page(serving: Serving) -> None:
    handles = serving().window.gui._gui_input_handle_from_uuid.values()
    lists = [handle.options for handle in handles if hasattr(handle, "options")]
    assert len(lists) > 8
    assert all(isinstance(option, str) and option for options in lists for option in options)


def test_what_is_typed_counts_for_what_is_done_next_and_what_is_refused_holds_it_up(serving: Serving) -> None:
    studio = serving()
    seeds: list[int] = []
    field = type("Field", (), {"value": "7"})
    event = type("Event", (), {"client": 1, "target": field})
    act = studio.window.action(lambda: seeds.append(studio.window.project.settings.seed))
    studio.window.settled(lambda: studio.window.edit(seed=7))(event)
    act(event)
    assert seeds == [7]
    studio.window.settled(lambda: studio.window.edit(seed=-1))(event)
    act(event)
    assert seeds == [7]
    act(event)
    assert seeds == [7, 7]
    studio.window.settled(lambda: studio.window.edit(seed=8))(event)
    assert eventually(lambda: studio.window.project.settings.seed == 8)  # after a little rest


def test_fields_that_are_typed_in_one_after_the_other_are_both_taken(serving: Serving) -> None:
    studio = serving()
    with window(studio) as line:
        working(studio, line)
        calibrate = next(page for page in studio.window.pages if page.title == "Calibrate")
        for field, text in ((calibrate._train, "12"), (calibrate._seed, "7")):  # type: ignore[attr-defined]
            send(line, type="GuiUpdateMessage", uuid=field._impl.uuid, updates={"value": text})
        assert eventually(
            lambda: (studio.window.project.settings.train, studio.window.project.settings.seed) == (12, 7)
        )
