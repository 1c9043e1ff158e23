"""Kill a process at every operation that changes files: counted, and not by chance.

A process that is killed leaves what it has done so far. Before every operation (a file opened for writing, a text
written, a file renamed, linked, removed or synchronised, a folder made or removed) a copy of the process ends itself
with the signal that nothing can catch. Python reports all of these operations but two to audit hooks; writing and
synchronising are reported here. So none is left out.
"""

from __future__ import annotations

import fcntl
import io
import os
import shutil
import signal
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

from truearm.engine.base.errors import InputError
from truearm.engine.base.files import read_bytes
from truearm.engine.base.manifest import MANIFEST, UNFINISHED

_CHANGES = ("os.rename", "os.remove", "os.rmdir", "os.mkdir", "os.link", "os.symlink", "os.truncate")
_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
#: How a child says that its work was refused; other endings are counts or signals.
_REFUSED, _FAILED = 2, 70


def operations(work: Callable[[], object], folder: Path) -> int:
    """Do some work in a copy of this process, and return how many operations below a folder changed files."""
    reading, writing = os.pipe()

    def counting() -> None:
        done = [0]
        before_each(folder, lambda _: done.__setitem__(0, done[0] + 1))
        work()
        os.write(writing, str(done[0]).encode())

    status = _in_a_copy(counting)
    os.close(writing)
    with os.fdopen(reading) as stream:
        text = stream.read()
    assert status == 0, f"the work ended with {status}"
    return int(text)


def killed(work: Callable[[], object], folder: Path, number: int) -> None:
    """Do some work in a copy of this process, which is killed before an operation, counted from 0."""

    def until() -> None:
        left = [number]

        def hook(half: Callable[[], object] | None) -> None:
            if left[0] == 0:
                if half is not None:
                    half()  # of a text some is on disk already
                os.kill(os.getpid(), signal.SIGKILL)
            left[0] -= 1

        before_each(folder, hook)
        work()

    status = _in_a_copy(until)
    assert status == -signal.SIGKILL, f"the work ended with {status} before operation {number}"


def killed_copies(work: Callable[[], object], folder: Path, kept: Path) -> list[Path]:
    """Do some work in a copy of this process, and return copies of a folder as a kill before each operation leaves it.

    A killed process leaves what is on disk at that moment, of a text that is being written a half. So one run shows
    what :func:`killed` needs a process for each operation for.

    Parameters
    ----------
    kept
        The folder for the copies, which is made; outside `folder`.
    """
    kept.mkdir()

    def copying() -> None:
        number = [0]
        busy = [False]

        def hook(half: Callable[[], object] | None) -> None:
            if busy[0]:
                return
            busy[0] = True
            if half is not None:
                half()
            if folder.exists():
                shutil.copytree(folder, kept / f"{number[0]:04}", symlinks=True)
            number[0] += 1
            busy[0] = False

        before_each(folder, hook)
        work()

    status = _in_a_copy(copying)
    assert status == 0, f"the work ended with {status}"
    return sorted(kept.iterdir())


def between(one: Callable[[], object], other: Callable[[], object], folder: Path, number: int) -> None:
    """Do some work, and other work at the same time, begun before an operation of the first, counted from 0."""

    def both() -> None:
        left = [number]
        children: list[int] = []

        def hook(_: Callable[[], object] | None) -> None:
            left[0] -= 1
            if left[0] == -1:
                children.append(_copy(other))
                if not _is_locked(folder):  # it is not in the way of the other, which comes in between as a whole
                    assert _end(children.pop()) == 0

        before_each(folder, hook)
        one()
        left[0] = -1
        for child in children:
            assert _end(child) == 0

    assert _end(_copy(both)) == 0


def _is_locked(folder: Path) -> bool:
    handles = [os.open(place, os.O_RDONLY) for place in (folder, *(p for p in folder.rglob("*") if p.is_dir()))]
    try:
        for handle in handles:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        for handle in handles:
            os.close(handle)
    return False


def done(work: Callable[[], object]) -> bool:
    """Do some work in a copy of this process, and return whether it was done; False if it was refused."""
    status = _in_a_copy(work)
    assert status in (0, _REFUSED), f"the work ended with {status}"
    return status == 0


def found(folder: Path, old: dict[str, bytes], new: dict[str, bytes], written: list[set[str]]) -> str:
    """Return what readers find where a run was killed: old, new or refused; a mixture fails.

    Parameters
    ----------
    old, new
        What stood in the folder before, and what the run writes, by name. A file is new as soon as it is not the old
        one; one that is the same in both says nothing.
    written
        The names of the files that belong together.
    """
    words = set()
    for names in written:
        states: dict[str, str] = {}
        refused = []
        for name in names:
            try:
                content: bytes | None = read_bytes(folder / name)
            except InputError as error:
                cure = error.cure or ""
                if (folder / name).exists():
                    refused.append(cure)
                    states[name] = "refused"
                    continue
                content = None
            if old.get(name) != new[name]:
                states[name] = "old" if content == old.get(name) else "new"
        seen = {state for name, state in states.items() if state != "old" or name in old}
        if "refused" in seen:
            assert all("again" in cure for cure in refused)
            there = {states.get(name) for name in names if (folder / name).exists()}
            assert there == {"refused"}, f"some of these can be read, and others not: {states}"
            words.add("refused")
            continue
        assert len(set(states.values())) <= 1, f"a mixture: {states}"
        words |= set(states.values())
    return next((word for word in ("refused", "new", "old") if word in words), "the same")


def leftovers(folder: Path) -> list[str]:
    """Return what a killed run has left below a folder besides files of results."""
    return [p.name for p in folder.rglob("*") if p.name == UNFINISHED or p.name.startswith(".truearm.")]


def contents(folder: Path) -> dict[str, bytes]:
    """Return what stands in a folder by name, its manifests left out."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file() and p.name != MANIFEST}


def _in_a_copy(work: Callable[[], object]) -> int:
    """Do some work in a copy of this process, and return its status, the signal as a negative number."""
    return _end(_copy(work))


def _end(child: int) -> int:
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def _copy(work: Callable[[], object]) -> int:
    """Do some work in a copy of this process, and return its number at once."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # other threads write no files
        child = os.fork()
    if child == 0:
        status = _FAILED
        try:
            work()
            status = 0
        except InputError:
            status = _REFUSED
        except BaseException:
            sys.excepthook(*sys.exc_info())
        finally:
            os._exit(status)
    return child


def before_each(folder: Path, hook: Callable[[Callable[[], object] | None], None]) -> None:
    """Call a hook before every operation below a folder, in this process and for ever."""
    inside = str(folder.resolve())

    def audited(event: str, words: tuple[Any, ...]) -> None:
        if event in _CHANGES or (event == "open" and isinstance(words[2], int) and words[2] & _WRITING):
            place = words[0]
            if isinstance(place, str | bytes | os.PathLike) and os.path.realpath(os.fsdecode(place)).startswith(inside):
                hook(None)

    sys.addaudithook(audited)
    synchronised, opened = os.fsync, io.open

    def synchronise(fd: Any) -> None:
        hook(None)
        synchronised(fd)

    class Stream(io.FileIO):
        def write(self, content: Any) -> int:
            place = self.tell()
            hook(lambda: io.FileIO.write(self, bytes(content)[: len(content) // 2]))
            if self.tell() != place:  # the half was looked at
                self.seek(place)
                self.truncate()
            return super().write(content)

    def open_counted(file: Any, mode: str = "r", *words: Any, **named: Any) -> Any:
        if "b" in mode and set(mode) & set("xwa") and not isinstance(file, int) and not named:
            return Stream(os.fspath(file), mode.replace("b", ""))
        return opened(file, mode, *words, **named)

    os.fsync = synchronise
    io.open = open_counted
