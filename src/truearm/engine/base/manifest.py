"""Files that were written together: the manifest of a folder, and the mark of a run that has not finished.

A run that writes several files into a folder leaves a manifest beside them: their names and hashes. Before it replaces
the first of them it writes a mark, and removes it after the manifest. So where a mark stands, some files may be new and
others old, and nothing that it names is read; where none stands, whatever differs from the manifest was changed later.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from truearm.engine.base.errors import InputError
from truearm.engine.base.version import __version__

#: What was written together into a folder, with hashes.
MANIFEST: Final = "truearm.manifest.json"
#: Stands in a folder as long as a run replaces files there.
UNFINISHED: Final = "truearm.unfinished.json"
_SCHEMAS: Final = {MANIFEST: "truearm-manifest/1", UNFINISHED: "truearm-unfinished/1"}
#: A manifest or mark of more bytes is none [bytes].
_LARGEST: Final = 50_000_000


@dataclass(frozen=True)
class FileSet:
    """Files that were written together."""

    files: Mapping[str, str]  #: Their hashes (SHA-256) by their names in the folder.
    command: str | None = None  #: How to write them again; None if that was not said.
    version: str = __version__  #: Of truearm, that wrote them.
    #: Hashes of the files that they were made from, by the parameters that named these; empty where that was not said.
    inputs: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Unfinished:
    """What a run that has not finished replaces."""

    new: FileSet  #: The files that it writes.
    old_names: Mapping[str, str]  #: The names beside them that the old ones have meanwhile, of those that there were.
    #: The names of empty files beside the others, those that there were not. Whoever could write a mark, or copied one,
    #: may not write beside every file that it names: without its empty file, none is removed.
    empty_names: Mapping[str, str]


def hash_of(content: bytes) -> str:
    """Return the hash by which files are compared."""
    return hashlib.sha256(content).hexdigest()


def manifest_text(sets: Sequence[FileSet]) -> str:
    """Return the text of a manifest."""
    content = {"truearm": _SCHEMAS[MANIFEST], "sets": [_written(set_) for set_ in sets]}
    return json.dumps(content, indent=1) + "\n"


def unfinished_text(run: Unfinished) -> str:
    """Return the text of the mark of a run that has not finished."""
    beside = {"kept": {**run.old_names}, "made": {**run.empty_names}}
    return json.dumps({"truearm": _SCHEMAS[UNFINISHED], **_written(run.new), **beside}, indent=1) + "\n"


def _written(set_: FileSet) -> dict[str, Any]:
    inputs = {"inputs": {**set_.inputs}} if set_.inputs else {}
    return {"version": set_.version, "command": set_.command, **inputs, "files": {**set_.files}}


def sets_in(folder: Path) -> tuple[FileSet, ...]:
    """Return what was written together into a folder, as its manifest says.

    Raises:
        InputError: If what has the name of the manifest is none.
    """
    content = _content(folder / MANIFEST)
    with _read_as_ours(folder / MANIFEST):
        return () if content is None else tuple(_file_set(entry) for entry in _checked(content["sets"], list))


def unfinished_in(folder: Path) -> Unfinished | None:
    """Return what a run that has not finished replaces in a folder; None if there is no such run.

    Raises:
        InputError: If what has the name of its mark is none.
    """
    content = _content(folder / UNFINISHED)
    if content is None:
        return None
    with _read_as_ours(folder / UNFINISHED):
        run = Unfinished(_file_set(content), _texts(content["kept"]), _texts(content["made"]))
    if {*run.new.files} != {*run.old_names, *run.empty_names}:
        raise not_ours(folder / UNFINISHED)
    return run


def refuse_unfinished(path: Path) -> None:
    """Refuse to read one of several files that a run replaces and has not finished with.

    Raises:
        InputError: If it is one of them.
    """
    for place in _places(path):
        for folder, run in unfinished_above(place):
            if str(place.relative_to(folder)) in run.new.files:
                raise InputError(
                    "a command that writes this file together with others has not finished,"
                    " and they may not belong together",
                    where=str(path),
                    came=f"its mark {folder / UNFINISHED}",
                    cure="Whatever writes into that folder next puts back what stood there before, so run that command"
                    f" again{f': {run.new.command}' if run.new.command else '.'}",
                )


def written_differently(path: Path) -> tuple[str, ...]:
    """Return what was written together with a file that has been changed or exchanged since; empty for any other.

    A run that was killed leaves its mark, so such a file was changed later, and the others do not describe it.
    """
    for place in _places(path):
        for folder in place.parents:
            name = str(place.relative_to(folder))
            for file_set in sets_in(folder):
                if name in file_set.files and hash_of(place.read_bytes()) != file_set.files[name]:
                    return tuple(other for other in file_set.files if other != name)
    return ()


def _places(path: Path) -> set[Path]:
    """Return where a file is, as it is named and with links followed."""
    places = {path.absolute()}
    with suppress(OSError, RuntimeError, ValueError):  # links that lead round, a zero byte
        places.add(path.resolve())
    return places


def unfinished_above(path: Path) -> Iterator[tuple[Path, Unfinished]]:
    """Return the runs that have not finished in the folders that a path is in, with those folders."""
    for folder in path.parents:
        run = unfinished_in(folder)
        if run is not None:
            yield folder, run


# -- reading, without the readers of inputs: those look here first --------------------------------------------


@contextmanager
def _read_as_ours(path: Path) -> Iterator[None]:
    try:
        yield
    except (KeyError, TypeError) as error:
        raise not_ours(path) from error


def _content(path: Path) -> dict[str, Any] | None:
    try:
        status = path.stat()
        if _planted(status, path.parent):
            return None
        if not stat.S_ISREG(status.st_mode) or status.st_size > _LARGEST:
            raise not_ours(path)
        content = json.loads(path.read_bytes())
    except (RecursionError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise not_ours(path) from error
    except InputError:
        raise
    except (OSError, ValueError):  # there is none, or it cannot be looked up, as the files beside it
        return None
    if not isinstance(content, dict) or content.get("truearm") != _SCHEMAS[path.name]:
        raise not_ours(path)
    return content


def _planted(status: os.stat_result, folder: Path) -> bool:
    """Return whether a file is of somebody else, in a folder that everybody may write to: it is not believed."""
    if sys.platform == "win32":
        return False
    place = folder.stat()
    return bool(place.st_mode & stat.S_ISVTX) and status.st_uid not in (os.getuid(), place.st_uid)


def _file_set(content: Any) -> FileSet:
    command, version = content["command"], _checked(content["version"], str)
    inputs = _texts(content.get("inputs", {}))
    return FileSet(_texts(content["files"]), command if command is None else _checked(command, str), version, inputs)


def _texts(content: Any) -> dict[str, str]:
    return {_checked(name, str): _checked(value, str) for name, value in _checked(content, dict).items()}


def _checked(value: Any, kind: type) -> Any:
    if not isinstance(value, kind):
        raise TypeError
    return value


def not_ours(path: Path) -> InputError:
    """Return the refusal of a manifest or mark that truearm cannot have written."""
    return InputError(
        f"truearm writes a file of this name itself, and this is not one: schema {_SCHEMAS[path.name]}",
        where=str(path),
        cure="Remove or rename it.",
    )
