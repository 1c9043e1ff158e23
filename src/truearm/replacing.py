"""How files take the place of others: in one step each, all of them or none, and put back where that was cut off."""

from __future__ import annotations

import os
import re
import secrets
import shutil
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Final

from truearm.errors import InputError
from truearm.files import reason_of
from truearm.manifest import UNFINISHED, FileSet, Unfinished, hash_of, not_ours, unfinished_in, unfinished_text

#: Names of files that are there only while others are written.
_TEMPORARY: Final = re.compile(r"\.truearm\.[0-9a-z_]{8,16}")


@contextmanager
def writing_refused_at(path: Path) -> Iterator[None]:
    """Turn what the operating system refuses into a refusal that names the file."""
    try:
        yield
    except OSError as error:
        raise InputError(f"the file cannot be written ({reason_of(error)})", where=str(path)) from error


@contextmanager
def alone_in(folders: Iterable[Path]) -> Iterator[None]:
    """Let other runs wait that write into the same folders; always in one order, so that no two wait for each other."""
    with ExitStack() as held:
        for folder in sorted({folder.resolve() for folder in folders}):
            held.enter_context(_locked(folder))
        yield


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Lock a folder; the lock ends with the process, however that ends."""
    if sys.platform == "win32":  # folders cannot be opened there
        yield
        return
    import fcntl

    handle = os.open(folder, os.O_RDONLY)
    try:
        with suppress(OSError):  # a file system without locks
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
        with suppress(OSError):  # by itself, as a copy of this process would hold on to it
            fcntl.flock(handle, fcntl.LOCK_UN)
    finally:
        os.close(handle)


def clear_temporary(folder: Path) -> None:
    """Remove what killed runs have left in a folder in which no other run writes now."""
    with suppress(OSError):
        for path in folder.iterdir():
            if _TEMPORARY.fullmatch(path.name):
                path.unlink(missing_ok=True)


def file_set(folder: Path, contents: Mapping[Path, bytes], command: str | None) -> FileSet:
    """Return what a folder's manifest says of files that are written together."""
    return FileSet({_name(target, folder): hash_of(content) for target, content in contents.items()}, command)


def _name(target: Path, folder: Path) -> str:
    """Return the name of a file in a folder, its whole path if it is elsewhere."""
    return str(target.relative_to(folder)) if target.is_relative_to(folder) else str(target.absolute())


def replace_all(
    folder: Path, contents: Mapping[Path, bytes], command: str | None, known: Mapping[Path, str | None]
) -> None:
    """Put new files in place of old ones, all or none, while those stand there that are known."""
    mark = folder / UNFINISHED
    staged: dict[Path, Path] = {}
    kept: dict[Path, Path] = {}
    made: dict[Path, Path] = {}
    try:
        for target, content in contents.items():
            with writing_refused_at(target):
                staged[target] = _temporary(target)
                _write(staged[target], content)
        if len(contents) > 1:
            for target in contents:
                with writing_refused_at(target):
                    if os.path.lexists(target):
                        kept[target] = _temporary(target)
                        _keep(target, kept[target])
                    else:
                        made[target] = _temporary(target)
                        made[target].touch(exist_ok=False)
            names = [{_name(target, folder): path.name for target, path in beside.items()} for beside in (kept, made)]
            with writing_refused_at(mark):
                staged[mark] = _temporary(mark)
                _write(staged[mark], unfinished_text(Unfinished(file_set(folder, contents, command), *names)).encode())
                synchronise(contents)
        for target, value in known.items():  # as late as can be: editors know nothing of locks
            with writing_refused_at(target):
                refuse_others(target, value)
        try:
            if mark in staged:
                with writing_refused_at(mark):
                    staged[mark].replace(mark)
                    del staged[mark]
                    synchronise([mark])
            for target, temporary in staged.items():
                with writing_refused_at(target):
                    if known.get(target, "") is None:
                        _name_first(temporary, target)
                    else:
                        temporary.replace(target)
            synchronise(contents)
            with writing_refused_at(mark):
                mark.unlink(missing_ok=True)
        except BaseException:
            with suppress(OSError):  # an old file that cannot be put back keeps its other name, and the mark
                undo_unfinished(folder)
            raise
    finally:
        beside = () if os.path.lexists(mark) else (*kept.values(), *made.values())
        for temporary in (*staged.values(), *beside):
            with suppress(OSError):
                temporary.unlink(missing_ok=True)


def refuse_others(target: Path, known: str | None) -> None:
    """Refuse to replace another file than the one that is known."""
    if (hash_of(target.read_bytes()) if target.is_file() else None) != known:
        raise _changed(target)


def name_anew(source: Path, target: Path) -> None:
    """Give a file another name in its folder, at once and only if nothing has that name.

    Raises:
        FileExistsError: If something has.
    """
    try:
        os.link(source, target, follow_symlinks=False)
    except FileExistsError:
        raise
    except OSError as error:  # where files cannot have two names
        if os.path.lexists(target):
            raise FileExistsError(target) from error
        source.replace(target)
    else:
        source.unlink()


def _name_first(source: Path, target: Path) -> None:
    """Give a file its name, and refuse where another has got it meanwhile."""
    try:
        name_anew(source, target)
    except FileExistsError as error:
        raise _changed(target) from error


def _changed(target: Path) -> InputError:
    return InputError(
        "another program has changed this file, and it is not overwritten",
        where=target.name,
        cure="Read it again, and make the change anew.",
    )


def undo_unfinished(folder: Path) -> None:
    """Put back the old files of a run that has not finished, and remove its mark; again and again if need be."""
    run = unfinished_in(folder)
    if run is None:
        return
    # not replaced yet, put back already, or changed since: such files stay
    targets = {name: folder / name for name, known in run.new.files.items() if is_the_known(folder / name, known)}
    if not all(_stands_beside(targets[name], run.made[name]) for name in targets if name in run.made):
        raise not_ours(folder / UNFINISHED)
    for name, target in targets.items():
        if name in run.made:
            target.unlink()
        elif _stands_beside(target, run.kept[name]):
            old = target.with_name(run.kept[name])
            old.replace(target)
            old.unlink(missing_ok=True)  # where both were one file under two names
    synchronise(folder / name for name in run.new.files)
    (folder / UNFINISHED).unlink()


def is_the_known(target: Path, known: str) -> bool:
    """Return whether a file is there and has the hash that is known of it."""
    return target.is_file() and hash_of(target.read_bytes()) == known


def _stands_beside(target: Path, name: str) -> bool:
    """Return whether a file stands beside another that only a run has put there."""
    return bool(_TEMPORARY.fullmatch(name)) and os.path.lexists(target.with_name(name))


def _temporary(target: Path) -> Path:
    """Return a new name beside a file, by which :func:`clear_temporary` knows what a killed run has left."""
    return target.with_name(f".truearm.{secrets.token_hex(8)}")


def _write(path: Path, content: bytes) -> None:
    with path.open("xb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())


def write_through(path: Path) -> None:
    """Let what a file holds be on disk before its name is."""
    handle = os.open(path, os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def synchronise(paths: Iterable[Path]) -> None:
    """Let what was done to the names of files be on disk before anything that follows."""
    for folder in {path.parent for path in paths}:
        with suppress(OSError):  # folders cannot be opened everywhere, and not every file system can do it
            handle = os.open(folder, os.O_RDONLY)
            try:
                os.fsync(handle)
            finally:
                os.close(handle)


def _keep(file: Path, name: Path) -> None:
    """Give a file a second name, or copy it where files cannot have two."""
    try:
        os.link(file, name, follow_symlinks=False)
    except OSError:
        shutil.copy2(file, name, follow_symlinks=False)
