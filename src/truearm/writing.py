"""Writing files so that nothing is ever half-written, and no input overwritten."""

from __future__ import annotations

import os
import secrets
import shutil
import tempfile
from collections.abc import Collection, Iterable, Mapping
from contextlib import suppress
from pathlib import Path

from truearm.errors import InputError, refusals_of
from truearm.files import broken_link, exists, path_argument, reason_of


def output_folder(
    folder: object, names: Iterable[str] = (), read: Collection[Path] = (), parameter: str = "folder"
) -> Path:
    """Return the folder that was given for files of some names, or refuse one that cannot be written to.

    Parameters
    ----------
    read
        None of these files may be overwritten.
    """
    with refusals_of(parameter):
        path = writable_folder(path_argument(folder, parameter))
        for name in names:
            refuse_overwriting(path / name, read)
    return path


def output_file(file: object, read: Iterable[Path] = (), parameter: str = "file") -> Path:
    """Return the file that was given to write to, or refuse a place that cannot be; `read` as for a folder."""
    with refusals_of(parameter):
        path = writable_file(path_argument(file, parameter))
        refuse_overwriting(path, read)
    return path


def write_text(path: Path, text: str) -> None:
    """Write a whole file or nothing: a reader never sees half of it, and a failure leaves the old one."""
    write_files(path.parent, {path.name: text})


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
        with tempfile.TemporaryFile(dir=folder):
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
        if path.exists() and not path.is_file():
            raise InputError("this is a device or a pipe, and a file must be written here", where=str(path))
    except OSError as error:
        raise InputError(f"the file cannot be written ({reason_of(error)})", where=str(path)) from error
    return path


def same_place(one: Path, other: Path) -> bool:
    """Return whether two paths lead to the same file, whether it exists or not."""
    try:
        return one.resolve() == other.resolve() or one.samefile(other)
    except (OSError, RuntimeError):  # where one of them does not exist, or links lead round
        return False


def refuse_overwriting(out: Path, inputs: Iterable[Path]) -> None:
    """Refuse an output that is one of the inputs, by whatever path."""
    for path in inputs:
        try:
            same = out.samefile(path)
        except (OSError, ValueError):  # where one of them does not exist they are not the same
            same = False
        if same:
            raise InputError(
                "this file is read, and would be overwritten", where=str(out), cure="Choose another `out`."
            )


def write_files(folder: Path, files: Mapping[str, str | bytes]) -> None:
    """Write several files into a folder, all of them or none.

    They are put in place only once all of them are on disk, each in one step. Whatever goes wrong or interrupts before
    the last one is there, the old files are put back, and new files and folders removed. Only where the process is
    killed or the machine stops between two steps, some of the files may be new and others old.

    Parameters
    ----------
    files
        What they hold, by name. Names may begin with folders in that folder, or be whole paths.

    Raises
    ------
    InputError
        If one of them cannot be written.
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
    made: list[Path] = []
    staged: dict[Path, Path] = {}
    kept: dict[Path, Path] = {}
    target = folder
    try:
        for target, content in contents.items():
            _make_folders(target.parent, made)
            staged[target] = target.with_name(f".truearm.{secrets.token_hex(8)}")
            with staged[target].open("xb") as stream:
                stream.write(content)
        for target in staged:
            if os.path.lexists(target):
                kept[target] = target.with_name(f".truearm.{secrets.token_hex(8)}")
                _keep(target, kept[target])
        _put_in_place(staged, kept)
        made.clear()
    except OSError as error:
        raise InputError(f"the file cannot be written ({reason_of(error)})", where=str(target)) from error
    finally:
        for temporary in (*staged.values(), *kept.values()):
            temporary.unlink(missing_ok=True)
        for new in reversed(made):
            with suppress(OSError):  # somebody else has put something into it
                new.rmdir()


def _make_folders(folder: Path, made: list[Path]) -> None:
    """Make a folder with those above it, and note which are new."""
    for missing in reversed([parent for parent in (folder, *folder.parents) if not parent.exists()]):
        made.append(missing)
        missing.mkdir(exist_ok=True)


def _keep(file: Path, name: Path) -> None:
    """Give a file a second name, or copy it where files cannot have two."""
    try:
        os.link(file, name, follow_symlinks=False)
    except OSError:
        shutil.copy2(file, name, follow_symlinks=False)


def _put_in_place(staged: Mapping[Path, Path], kept: dict[Path, Path]) -> None:
    """Move new files to where they belong; where that fails, put back the old ones that were kept."""
    try:
        for target, temporary in staged.items():
            temporary.replace(target)
    except BaseException:
        for target, temporary in staged.items():
            with suppress(OSError):  # an old file that cannot be put back stays beside its place
                if target in kept:
                    old = kept.pop(target)
                    old.replace(target)
                    old.unlink(missing_ok=True)
                elif not temporary.exists():
                    target.unlink()
        raise
