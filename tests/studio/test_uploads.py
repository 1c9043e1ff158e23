"""Files that windows send: written as they come, named once they are whole, and none is left over."""

from __future__ import annotations

import errno
import sys
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

import pytest
from tests.studio.conftest import Serving
from tests.studio.talking import alive, element, eventually, is_closed, messages_of, send, shown, window, working
from websockets.exceptions import ConnectionClosed

from truearm.studio import uploads as module
from truearm.studio.pages.cell import CellPage
from truearm.studio.project import PROJECT_FILE, open_project
from truearm.studio.serving import Studio
from truearm.studio.uploads import Uploads


def taking(studio: Studio) -> str:
    """Return the button that takes files."""
    return element(studio, CellPage, "Take a file into the project")


def begin(line: Any, button: str, name: str, size: int, parts: int = 1) -> None:
    send(
        line,
        type="FileTransferStartUpload",
        source_component_uuid=button,
        transfer_uuid=name,
        filename=name,
        mime_type="text/csv",
        part_count=parts,
        size_bytes=size,
    )


def part(line: Any, button: str, name: str, number: int, content: bytes) -> None:
    with suppress(ConnectionClosed):  # by the other end, which has seen enough
        send(
            line,
            type="FileTransferPart",
            source_component_uuid=button,
            transfer_uuid=name,
            part_index=number,
            content=content,
        )


def upload(line: Any, button: str, name: str, content: bytes, size: int, parts: int = 1) -> None:
    begin(line, button, name, size, parts)
    for number in range(parts):
        part(line, button, name, number, content)


def coming(studio: Studio) -> list[int]:
    """Return the sizes of files that are coming, as they are on disk; the studio may remove one meanwhile."""
    sizes = []
    for path in studio.window.project.folder.glob(".truearm-upload.*"):
        with suppress(FileNotFoundError):
            sizes.append(path.stat().st_size)
    return sizes


def test_files_are_taken_in_and_those_too_large_are_refused_before_they_come(serving: Serving) -> None:
    said: list[str] = []
    studio = serving(say=said.append)
    button = taking(studio)
    with window(studio) as line:
        working(studio, line)
        upload(line, button, "a.csv", b"one,two\n", 8)
        upload(line, button, "empty.csv", b"", 0, 0)
        assert eventually(lambda: {"a.csv", "empty.csv"} <= set(studio.window.project.names()))
        upload(line, button, "huge.csv", bytes(100_000), 10**9, 2000)
        assert eventually(lambda: any("too large to be taken in: 1000000000 bytes" in text for text in said))
        names = (
            "../b.csv",
            "/tmp/b.csv",
            "..\\b.csv",
            ".hidden",
            "truearm-studio.yaml",
            "a\nb.csv",
            "b/c.csv",
            "a.csv",
        )
        for name in names:
            upload(line, button, name, b"x", 1)
        assert eventually(lambda: studio.window._notices.content.count("Error (refused)") == len(names))
        assert eventually(lambda: coming(studio) == [])
        assert studio.window.gui._current_file_upload_states == {}  # viser holds nothing of any
    folder = studio.window.project.folder
    assert sorted(path.name for path in folder.iterdir()) == ["a.csv", "empty.csv", PROJECT_FILE]
    assert (folder / "a.csv").read_bytes() == b"one,two\n"
    assert not list(folder.parent.glob("b.csv"))
    assert alive(studio)


def test_a_file_of_many_parts_is_on_disk_as_it_comes_and_the_window_is_told_how_much(serving: Serving) -> None:
    studio = serving()
    button = taking(studio)
    with window(studio) as line:
        working(studio, line)
        begin(line, button, "long.csv", 3_000, 300)
        for number in range(299):
            part(line, button, "long.csv", number, b"0123456789")
        assert eventually(lambda: coming(studio) == [2_990])
        assert studio.window.project.names() == []
        part(line, button, "long.csv", 299, b"abcdefghij")
        assert eventually(lambda: studio.window.project.names() == ["long.csv"])
        assert eventually(lambda: coming(studio) == [])
        told = messages_of(line, "FileTransferPartAck", until=lambda one: one["transferred_bytes"] == 3_000)
    assert {one["total_bytes"] for one in told} == {3_000}
    assert (studio.window.project.folder / "long.csv").read_bytes() == b"0123456789" * 299 + b"abcdefghij"


def test_a_file_that_is_refused_is_forgotten_by_the_window(serving: Serving) -> None:
    studio = serving()
    with window(studio) as line:
        working(studio, line)
        begin(line, taking(studio), "huge.csv", 10**9, 2_000)
        (told,) = messages_of(line, "FileTransferPartAck", until=lambda _: True)
    assert (told["transfer_uuid"], told["transferred_bytes"], told["total_bytes"]) == ("huge.csv", 0, 0)


def test_a_script_in_the_name_of_a_file_stays_a_name(serving: Serving) -> None:
    studio = serving()
    name = "<img src=x onerror=alert(1)>.csv"
    with window(studio) as line:
        working(studio, line)
        upload(line, taking(studio), name, b"x", 1)
        assert eventually(lambda: "Taken into the project" in studio.window._notices.content)
        assert eventually(lambda: studio.window.project.names() == [name])

    assert eventually(lambda: "&lt;img src=x onerror=alert(1)&gt;.csv" in shown(studio))
    assert "<img" not in shown(studio)


@pytest.mark.parametrize(("size", "parts", "said_of_it"), [(100, 3, "more of a file"), (900_000, 3, "less of a file")])
def test_another_size_than_was_announced_closes_the_connection(
    serving: Serving, size: int, parts: int, said_of_it: str
) -> None:
    said: list[str] = []
    studio = serving(say=said.append)
    with window(studio) as line:
        working(studio, line)
        upload(line, taking(studio), "lie.csv", bytes(200_000), size, parts)
        assert is_closed(line)
    assert any(f"{said_of_it} than was announced" in text for text in said)
    assert coming(studio) == []
    assert studio.window.project.names() == []
    assert alive(studio)


@pytest.mark.parametrize(
    "changes",
    [
        {"size_bytes": -1},
        {"part_count": -1},
        {"part_count": 9},
        {"part_count": 0},
        {"size_bytes": "8"},
        {"filename": 5},
    ],
)
def test_a_file_that_the_page_would_not_send_closes_the_connection(serving: Serving, changes: dict[str, Any]) -> None:
    studio = serving()
    with window(studio) as line:
        working(studio, line)
        start: dict[str, Any] = {"type": "FileTransferStartUpload", "source_component_uuid": taking(studio)}
        start |= {"transfer_uuid": "1", "filename": "a", "mime_type": "", "part_count": 1, "size_bytes": 8}
        send(line, **{**start, **changes})
        assert is_closed(line)
    assert coming(studio) == []
    assert alive(studio)


def test_what_has_not_come_whole_is_removed_with_its_window_and_with_the_studio(serving: Serving) -> None:
    studio = serving()
    button = taking(studio)
    for way in ("window", "studio"):
        with window(studio) as line:
            working(studio, line)
            begin(line, button, "half.csv", 100, 10)
            part(line, button, "half.csv", 0, b"0123456789")
            assert eventually(lambda: coming(studio) == [10])
            if way == "studio":
                studio.stop()
        assert eventually(lambda: coming(studio) == [])
        assert eventually(lambda: not studio.window.gate.has_worker)
    assert studio.window.project.names() == []


def test_so_many_files_come_at_once_and_those_that_have_stopped_make_room(
    serving: Serving, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[str] = []
    studio = serving(say=said.append)
    button = taking(studio)
    with window(studio) as line:
        working(studio, line)
        for name in "abcde":
            begin(line, button, name, 10, 2)
        assert eventually(lambda: any("too many files at once" in text for text in said))
        assert len(coming(studio)) == 4
        monkeypatch.setattr(module, "_PATIENCE", 0.0)
        begin(line, button, "f", 10, 2)
        assert eventually(lambda: len(coming(studio)) == 1)
        part(line, button, "a", 0, b"01234")  # of a file that has made room
        part(line, button, "f", 0, b"01234")
        part(line, button, "f", 1, b"56789")
        assert eventually(lambda: studio.window.project.names() == ["f"])


def test_nothing_that_takes_no_file_is_sent_one_nor_is_one_taken_of_a_window_that_reads(serving: Serving) -> None:
    said: list[str] = []
    studio = serving(say=said.append)
    blocked: list[str] = []
    studio.window.gate.blocked = lambda _, why, message: blocked.append(why)
    with window(studio) as first, window(studio) as second:
        working(studio, first)
        upload(first, element(studio, CellPage, "Robot"), "a.csv", b"x", 1)
        assert eventually(lambda: any("a file for nothing that takes files" in text for text in said))
        upload(second, taking(studio), "b.csv", b"x", 1)
        assert eventually(lambda: any("this window only reads" in text for text in blocked))
    assert not any("only reads" in text for text in said)
    assert studio.window.project.names() == []


def test_a_full_disk_is_named(serving: Serving, monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    studio = serving(say=said.append)

    class Full:
        def write(self, _: bytes) -> int:
            raise OSError(errno.ENOSPC, "No space left on device")

        def close(self) -> None:
            pass

    opened = Uploads._opened

    def full(self: Uploads, sender: object, name: str, coming: module.Upload) -> str | None:
        why = opened(self, sender, name, coming)
        assert coming._stream is not None
        coming._stream.close()
        coming._stream = Full()  # type: ignore[assignment]
        return why

    monkeypatch.setattr(Uploads, "_opened", full)
    with window(studio) as line:
        working(studio, line)
        upload(line, taking(studio), "a.csv", b"x", 1)
        assert eventually(lambda: any("the file cannot be written (No space left on device)" in text for text in said))
    assert coming(studio) == []
    assert alive(studio)


@pytest.mark.skipif(sys.platform == "win32", reason="no such locks there")
def test_what_a_killed_studio_has_left_is_removed_and_what_comes_to_another_one_stays(tmp_path: Path) -> None:
    open_project(tmp_path)
    left, comes = (tmp_path / f".truearm-upload.{number:016x}" for number in (1, 2))
    left.write_bytes(b"x")
    stream: IO[bytes]
    with comes.open("xb") as stream:
        module._lock_alone(stream)
        open_project(tmp_path)
        assert [path.name for path in tmp_path.iterdir() if path.name != PROJECT_FILE] == [comes.name]
    open_project(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == [PROJECT_FILE]
