"""Writing files: all of them or none, and nothing that is no plain file is replaced."""

from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest

from truearm.engine.base.errors import InputError
from truearm.engine.base.files import read_bytes
from truearm.engine.base.manifest import MANIFEST, UNFINISHED, hash_of, sets_in
from truearm.engine.base.writing import output_folder, put_in_place, write_files, write_text, write_text_over


def test_what_is_no_plain_file_is_not_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "folder").mkdir()
    with pytest.raises(InputError, match="this is a folder, and a file must be written here"):
        write_files(tmp_path, {"new": "", "folder": ""})
    monkeypatch.chdir(tmp_path)  # the path of a socket must be short
    with socket.socket(socket.AF_UNIX) as pipe:
        pipe.bind("pipe")
        with pytest.raises(InputError, match="this is a device or a pipe"):
            write_text(tmp_path / "pipe", "")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["folder", "pipe"]


def test_a_name_as_long_as_may_be_is_written(tmp_path: Path) -> None:
    write_text(tmp_path / ("x" * 255), "text")
    assert (tmp_path / ("x" * 255)).read_text() == "text"
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize("wrong", [KeyboardInterrupt(), OSError(28, "No space left on device")])
@pytest.mark.parametrize(("call", "after"), [("open", 0), ("open", 2), ("replace", 0), ("replace", 1), ("replace", 2)])
def test_all_files_are_new_or_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wrong: BaseException, call: str, after: int
) -> None:
    (tmp_path / "a").write_text("old a")
    (tmp_path / "c").write_text("old c")
    right, left = getattr(Path, call), [after]

    def fails(path: Path, *words: object, **named: object) -> object:
        left[0] -= 1
        if left[0] == -1:
            raise wrong
        return right(path, *words, **named)

    monkeypatch.setattr(Path, call, fails)
    with pytest.raises(InputError if isinstance(wrong, OSError) else KeyboardInterrupt):
        write_files(tmp_path, {"a": "new", "folder/b": "new", "c": "new"})
    monkeypatch.undo()
    assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {"a": "old a", "c": "old c"}


def test_files_are_kept_where_they_cannot_have_two_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object, **__: object) -> None:
        raise PermissionError

    monkeypatch.setattr(os, "link", refused)
    (tmp_path / "a").write_text("old")
    write_files(tmp_path, {"a": "new", "b": "new"})
    assert {p.name: p.read_text() for p in tmp_path.iterdir() if p.name != MANIFEST} == {"a": "new", "b": "new"}


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="there is no folder that lies about being writable")
def test_the_message_names_the_place_that_was_given() -> None:
    with pytest.raises(InputError, match=r"^/proc: the folder cannot be written to"):
        write_text(Path("/proc/x"), "")


def test_half_a_character_is_not_written(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"holds half a character; got '\\ud800'"):
        write_files(tmp_path / "new", {"a": "a", "b": "\ud800"})
    assert not (tmp_path / "new").exists()


def test_a_file_in_the_folder_that_was_not_written_there_by_us_is_not_replaced(tmp_path: Path) -> None:
    output_folder(tmp_path, ["a", "b"], ours=True)
    write_files(tmp_path, {"a": "1", "b": "2"})
    output_folder(tmp_path, ["a", "b"], ours=True)
    (tmp_path / "report.html").write_text("mine")
    with pytest.raises(InputError, match=r"report\.html: this exists already, was not written here by truearm"):
        output_folder(tmp_path, ["a", "b", "report.html"], ours=True)


def test_an_interrupt_behind_the_mark_puts_back_the_old_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a").write_text("old")
    right = os.fsync

    def fails(handle: int) -> None:
        if (tmp_path / UNFINISHED).exists() and not (tmp_path / MANIFEST).exists():
            monkeypatch.undo()
            raise KeyboardInterrupt
        right(handle)

    monkeypatch.setattr(os, "fsync", fails)
    with pytest.raises(KeyboardInterrupt):
        write_files(tmp_path, {"a": "new", "b": "new"})
    assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {"a": "old"}


def test_a_file_is_written_over_the_one_that_is_known_and_over_no_other(tmp_path: Path) -> None:
    file = tmp_path / "a"
    write_text_over(file, "one", None)
    write_text_over(file, "two", hash_of(b"one"))
    for known in (None, hash_of(b"one")):
        with pytest.raises(InputError, match="another program has changed this file, and it is not overwritten"):
            write_text_over(file, "three", known)
    file.unlink()
    with pytest.raises(InputError, match="another program has changed this file"):
        write_text_over(file, "three", hash_of(b"two"))
    assert list(tmp_path.iterdir()) == []


def test_a_new_file_is_made_only_where_none_has_come_meanwhile(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another program, which knows nothing of locks, makes it in the last moment."""
    file, link = tmp_path / "a", os.link

    def late(*names: Path, **how: bool) -> None:
        file.write_text("another's")
        link(names[0], names[1], follow_symlinks=how["follow_symlinks"])

    monkeypatch.setattr(os, "link", late)
    with pytest.raises(InputError, match="another program has changed this file"):
        write_text_over(file, "mine", None)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a": "another's"}


def test_of_several_files_none_is_written_where_one_is_another_than_is_known(tmp_path: Path) -> None:
    write_files(tmp_path, {"a": "old a", "b": "old b"})
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(InputError, match="another program has changed this file"):
        write_files(tmp_path, {"a": "new", "b": "new"}, standing={"b": None})
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


@pytest.mark.parametrize("links", [True, False])
def test_a_file_is_put_in_its_place_and_in_the_place_of_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, links: bool
) -> None:
    def refused(*_: object, **__: object) -> None:
        raise PermissionError

    if not links:
        monkeypatch.setattr(os, "link", refused)
    source = tmp_path / ".new"
    source.write_text("one")
    put_in_place(source, tmp_path / "a")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a": "one"}
    source.write_text("two")
    with pytest.raises(InputError, match="exists already and is not overwritten"):
        put_in_place(source, tmp_path / "a")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a": "one", ".new": "two"}


def test_a_file_that_appears_while_another_is_put_in_its_place_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source, target, link = tmp_path / ".new", tmp_path / "a", os.link
    source.write_text("one")

    def late(*names: Path, **how: bool) -> None:
        target.write_text("another's")
        link(names[0], names[1], follow_symlinks=how["follow_symlinks"])

    monkeypatch.setattr(os, "link", late)
    with pytest.raises(InputError, match="exists already and is not overwritten"):
        put_in_place(source, target)
    assert target.read_text() == "another's"


def test_a_file_in_the_place_of_one_of_a_set_that_was_removed_is_the_sets_no_more(tmp_path: Path) -> None:
    write_files(tmp_path, {"a": "1", "b": "2"})
    (tmp_path / "a").unlink()
    source = tmp_path / ".new"
    source.write_text("mine")
    put_in_place(source, tmp_path / "a")
    assert read_bytes(tmp_path / "a") == b"mine"
    assert [name for one in sets_in(tmp_path) for name in one.files] == ["b"]
    assert not source.exists()
