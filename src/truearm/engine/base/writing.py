"""Writing files so that nothing is ever half-written, and no input overwritten."""

from __future__ import annotations

import os
import re
import secrets
import shutil
import sys
import tempfile
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Final

from truearm.engine.base.errors import InputError, refusals_of
from truearm.engine.base.files import broken_link, exists, path_argument, reason_of
from truearm.engine.base.manifest import (
    MANIFEST,
    UNFINISHED,
    FileSet,
    Unfinished,
    hash_of,
    manifest_text,
    not_ours,
    sets_in,
    unfinished_above,
    unfinished_in,
    unfinished_text,
)

if sys.platform != "win32":
    import fcntl

# How files take the place of others: in one step each, all of them or none, and put back where that was cut off.

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
    with ExitStack() as locks:
        for folder in sorted({folder.resolve() for folder in folders}):
            locks.enter_context(locked(folder, wait=True))
        yield


@contextmanager
def locked(folder: Path, *, wait: bool) -> Iterator[bool]:
    """Lock a folder, and return whether that could be done; the lock ends with the process, however that ends."""
    if sys.platform == "win32":  # folders cannot be opened there
        yield True
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        yield lock(handle, wait=wait)
        with suppress(OSError):  # by itself, as a copy of this process would hold on to it
            fcntl.flock(handle, fcntl.LOCK_UN)
    finally:
        os.close(handle)


def lock(handle: int, *, wait: bool) -> bool:
    """Lock what is open, as long as it is; return False where another has it, and it is not waited for.

    Windows, and file systems without locks, keep nobody apart.
    """
    if sys.platform != "win32":
        try:
            fcntl.flock(handle, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        except OSError:
            pass
    return True


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
    """Put new files in place of old ones, all or none, while those stand there that are known.

    What it leaves beside them is for :func:`clear_temporary`, unless the mark still stands.
    """
    mark = folder / UNFINISHED
    staged = {target: _staged(target, content) for target, content in contents.items()}
    if len(contents) > 1:
        old_names, empty_names = dict[str, str](), dict[str, str]()
        for target in contents:
            with writing_refused_at(target):
                beside = _temporary(target)
                if os.path.lexists(target):
                    old_names[_name(target, folder)] = beside.name
                    _keep(target, beside)
                else:
                    empty_names[_name(target, folder)] = beside.name
                    beside.touch(exist_ok=False)
        run = Unfinished(file_set(folder, contents, command), old_names, empty_names)
        staged = {mark: _staged(mark, unfinished_text(run).encode()), **staged}
        synchronise(contents)
    for target, value in known.items():  # as late as can be: editors know nothing of locks
        with writing_refused_at(target):
            refuse_others(target, value)
    try:
        for target, temporary in staged.items():
            with writing_refused_at(target):
                if known.get(target, "") is None:
                    _name_first(temporary, target)
                else:
                    temporary.replace(target)
            if target == mark:
                synchronise([mark])
        synchronise(contents)
        with writing_refused_at(mark):
            mark.unlink(missing_ok=True)
    except BaseException:
        with suppress(OSError):  # an old file that cannot be put back keeps its other name, and the mark
            undo_unfinished(folder)
        raise


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
    if not all(_stands_beside(targets[name], run.empty_names[name]) for name in targets if name in run.empty_names):
        raise not_ours(folder / UNFINISHED)
    for name, target in targets.items():
        if name in run.empty_names:
            target.unlink()
        elif _stands_beside(target, run.old_names[name]):
            old = target.with_name(run.old_names[name])
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


def _staged(target: Path, content: bytes) -> Path:
    """Write what a file will hold under another name beside it, and return that."""
    with writing_refused_at(target):
        path = _temporary(target)
        with path.open("xb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        return path


def write_through(path: Path, flags: int = os.O_RDWR) -> None:
    """Let what a file holds be on disk before its name is."""
    handle = os.open(path, flags)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def synchronise(paths: Iterable[Path]) -> None:
    """Let what was done to the names of files be on disk before anything that follows."""
    for folder in {path.parent for path in paths}:
        with suppress(OSError):  # folders cannot be opened everywhere, and not every file system can do it
            write_through(folder, os.O_RDONLY)


def _keep(file: Path, name: Path) -> None:
    """Give a file a second name, or copy it where files cannot have two."""
    try:
        os.link(file, name, follow_symlinks=False)
    except OSError:
        shutil.copy2(file, name, follow_symlinks=False)


def output_folder(
    folder: object,
    names: Iterable[str] = (),
    read: Collection[Path] = (),
    parameter: str = "folder",
    *,
    ours: bool = False,
) -> Path:
    """Return the folder that was given for files of some names, or refuse one that cannot be written to.

    Args:
        names: Of the files.
        read: None of these files may be overwritten.
        ours: Whether a file of one of the names that stands there already has to be as the folder's manifest has it:
            then truearm has written it, and nobody has changed it since.
    """
    with refusals_of(parameter):
        path = writable_folder(path_argument(folder, parameter))
        _refuse_others_of(path, names, read, ours)
    return path


def output_file(file: object, read: Collection[Path] = (), parameter: str = "file", *, ours: bool = False) -> Path:
    """Return the file that was given to write to, or refuse a place that cannot be; `read` and `ours` as for a folder.

    Only files that are written together with others stand in the manifest.
    """
    with refusals_of(parameter):
        path = writable_file(path_argument(file, parameter))
        _refuse_others_of(path.parent, [path.name], read, ours)
    return path


def _refuse_others_of(folder: Path, names: Iterable[str], read: Collection[Path], ours: bool) -> None:
    put_back_old(folder)
    sets = sets_in(folder)
    for name in names:
        path = folder / name
        refuse_overwriting(path, read)
        known = [set_.files[name] for set_ in sets if name in set_.files]
        if not ours or not exists(path) or any(is_the_known(path, hashed) for hashed in known):
            continue
        raise InputError(
            "this was written here by truearm and has been changed since, and is not overwritten"
            if known and path.is_file()
            else "this exists already, was not written here by truearm, and is not overwritten",
            where=str(path),
            cure="Choose another `out`, or move the file.",
        )


def write_text(path: Path, text: str) -> None:
    """Write a whole file or nothing: a reader never sees half of it, and a failure leaves the old one."""
    write_files(path.parent, {path.name: text})


def write_text_over(path: Path, text: str, known: str | None) -> None:
    """Write a whole file in place of the one that is known, and refuse to where another stands there by now.

    Args:
        known: Hash of the file that is replaced (:func:`truearm.engine.base.manifest.hash_of`); None if there shall be
        none.
    """
    write_files(path.parent, {path.name: text}, standing={path.name: known})


def remove_known(path: Path, known: str | None) -> None:
    """Remove the file that is known by its hash, and refuse to where another stands there by now."""
    with writing_refused_at(path), alone_in([path.parent]):
        refuse_others(path, known)
        path.unlink(missing_ok=True)
        synchronise([path])


def put_in_place(source: Path, target: Path) -> None:
    """Give a file beside its place its name there, once it is on disk; nothing is overwritten.

    Raises:
        InputError: If something of that name stands there, or it cannot be moved.
    """
    new_file(target)
    put_back_old(target.parent)
    if any(target.name in set_.files for set_ in sets_in(target.parent)):  # it was removed, and comes again
        write_files(target.parent, {target.name: source.read_bytes()}, standing={target.name: None})
        source.unlink()
        return
    with writing_refused_at(target), alone_in([target.parent]):
        write_through(source)
        try:
            name_anew(source, target)
        except FileExistsError:
            new_file(target)
            raise
        synchronise([target])


def write_new_text(path: Path, text: str) -> None:
    """Write a file that does not exist yet; nothing is overwritten."""
    write_text(new_file(path), text)


def new_file(path: Path) -> Path:
    """Make sure that a file does not exist yet and can be written at `path`, before any long work, and return it."""
    if exists(path):
        raise InputError("this exists already and is not overwritten", where=str(path), cure="Choose another name.")
    return writable_file(path)


def writable_folder(folder: Path) -> Path:
    """Make sure that files can be written in `folder`, before any long work, and return it."""
    try:
        for parent in (folder, *folder.parents):
            if parent.is_symlink() and not parent.exists():
                raise broken_link(parent)
            if parent.exists():
                if not parent.is_dir():
                    raise InputError("this is a file, a folder is needed", where=str(parent))
                _try_writing(parent)
                break
    except OSError as error:
        raise InputError(f"the folder cannot be used ({reason_of(error)})", where=str(folder)) from error
    return folder


def _try_writing(folder: Path) -> None:
    """Refuse a folder that no file can be made in: its permissions alone do not tell."""
    try:
        with tempfile.TemporaryFile(dir=folder, prefix=".truearm."):
            pass
    except OSError as error:
        raise InputError("the folder cannot be written to", where=str(folder), cure="Choose another `out`.") from error


def writable_file(path: Path) -> Path:
    """Make sure that a file can be written at `path`, before any long work, and return it."""
    writable_folder(path.parent)
    try:
        if path.is_symlink() and not path.exists():
            raise broken_link(path)
        if path.name in ("", "..") or path.is_dir():
            raise InputError("this is a folder, and a file must be written here", where=str(path))
        if path.name in (MANIFEST, UNFINISHED):
            raise InputError("truearm writes a file of this name itself", where=str(path), cure="Choose another name.")
        if path.exists() and not path.is_file():
            raise InputError("this is a device or a pipe, and a file must be written here", where=str(path))
    except OSError as error:
        raise InputError(f"the file cannot be written ({reason_of(error)})", where=str(path)) from error
    return path


def same_place(path: Path, other: Path) -> bool:
    """Return whether two paths lead to the same file, whether it exists or not."""
    try:
        return path.resolve() == other.resolve() or path.samefile(other)
    except (OSError, RuntimeError, ValueError):  # where one of them does not exist, or links lead round
        return False


def refuse_overwriting(out: Path, inputs: Iterable[Path]) -> None:
    """Refuse an output that is one of the inputs, by whatever path."""
    if any(same_place(out, path) for path in inputs):
        raise InputError("this file is read, and would be overwritten", where=str(out), cure="Choose another `out`.")


def write_files(
    folder: Path,
    files: Mapping[str, str | bytes],
    command: str | None = None,
    standing: Mapping[str, str | None] | None = None,
    inputs: Mapping[str, str] | None = None,
) -> None:
    """Write several files into a folder, all of them or none, with a manifest of them.

    They are put in place only once all of them are on disk, each in one step, while no other run writes there. Whatever
    goes wrong or interrupts before the last one is there, the old files are put back, and new files and folders
    removed. Where the process is killed or the machine stops between two steps, the mark of an unfinished run stands
    there (:mod:`truearm.engine.base.manifest`): none of the files can be read until the next run puts back the old
    ones.

    Where the file system knows no locks, two runs at the same time are not kept apart.

    Args:
        files: What they hold, by name, in the order in which they are put in place. Names may begin with folders in
            that folder, or be whole paths.
        command: How to write them again, for the manifest.
        standing: Hashes of files that must stand there as they are known, by name; None for one that must not be there.
        inputs: Hashes of the files that they were made from, by parameter, for the manifest.

    Raises:
        InputError: If one of them cannot be written, or another stands there than is known.
    """
    contents: dict[Path, bytes] = {}
    for name, text in files.items():
        target = writable_file(folder / name)
        try:
            contents[target] = text if isinstance(text, bytes) else text.encode()
        except UnicodeEncodeError as error:
            raise InputError(
                "the text for this file holds half a character", where=str(target), came=text[error.start]
            ) from error
    folders = dict.fromkeys((folder, *(target.parent for target in contents)))
    created: list[Path] = []
    try:
        for place in folders:
            with writing_refused_at(place):
                _make_folders(place, created)
            put_back_old(place)
        with alone_in(folders):
            for place in folders:
                with writing_refused_at(place):
                    undo_unfinished(place)
                    clear_temporary(place)
            known = {folder / name: value for name, value in (standing or {}).items()}
            try:
                replace_all(folder, _with_manifest(folder, contents, command, inputs or {}), command, known)
            finally:
                if not os.path.lexists(folder / UNFINISHED):
                    for place in folders:
                        clear_temporary(place)
        created.clear()
    finally:
        for new in reversed(created):
            with suppress(OSError):  # somebody else has put something into it
                new.rmdir()


def put_back_old(folder: Path) -> None:
    """Put back the old files where a run that wrote into a folder was killed between two steps."""
    for place, run in unfinished_above(folder.absolute() / "any"):
        folders = {place, *((place / name).parent for name in run.new.files)}
        with writing_refused_at(place), alone_in(each for each in folders if each.is_dir()):
            undo_unfinished(place)
            for each in folders:
                clear_temporary(each)


def _with_manifest(
    folder: Path, contents: Mapping[Path, bytes], command: str | None, inputs: Mapping[str, str]
) -> dict[Path, bytes]:
    """Return contents with the folder's manifest behind them, where they belong into one."""
    new = replace(file_set(folder, contents, command), inputs=inputs)
    before = sets_in(folder)
    if len(contents) == 1 and not any(name in set_.files for set_ in before for name in new.files):
        return {**contents}
    sets = []
    for set_ in before:
        stay = {name: known for name, known in set_.files.items() if name not in new.files and exists(folder / name)}
        if stay:
            sets.append(replace(set_, files=stay))
    if len(contents) > 1:
        sets.append(new)
    return {**contents, folder / MANIFEST: manifest_text(sets).encode()}


def _make_folders(folder: Path, created: list[Path]) -> None:
    """Make a folder with those above it, and note which are new."""
    for missing in reversed([parent for parent in (folder, *folder.parents) if not parent.exists()]):
        created.append(missing)
        missing.mkdir(exist_ok=True)
