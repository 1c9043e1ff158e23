"""The parts of a fleet on disk: written once, never computed twice, and read robot by robot.

``record.json`` says what is asked; ``parts/`` holds a file for each part that is done, a line of JSON for each robot
behind a line of what they share. A file is there as a whole or not at all.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from pydantic_core import from_json, to_json

from truearm.errors import InputError
from truearm.files import exists, read_text
from truearm.fleets.manifest import Manifest
from truearm.fleets.rows import Row
from truearm.version import __version__
from truearm.writing import write_text

RECORD: Final = "record.json"
PARTS: Final = "parts"
_RECORD_SCHEMA: Final = "truearm-fleet-record/1"
_PART_SCHEMA: Final = "truearm-fleet-part/1"
#: Files of a folder at most.
_TOGETHER: Final = 1000


def part_text(rows: list[Row], shared: Mapping[str, Mapping[str, Any]]) -> str:
    """Return robots as a part holds them, behind its first line."""
    lines = [to_json({"shared": shared}), *(to_json(row.content(shared)) for row in rows)]
    return "".join(f"{line.decode()}\n" for line in lines)


@dataclass(frozen=True)
class Recorded:
    """The parts of a fleet in a folder.

    Attributes
    ----------
    folder
        Where they are.
    manifest
        What is asked.
    """

    folder: Path
    manifest: Manifest

    def file(self, part: int) -> Path:
        """Return where a part is, counted from 0."""
        return self.folder / PARTS / f"{part // _TOGETHER:04}" / f"{part + 1:07}.jsonl"

    def check(self) -> None:
        """Refuse a folder in which something else was asked.

        Raises
        ------
        InputError
            If parts of another manifest, other files or another version of truearm stand there.
        """
        path = self.folder / RECORD
        if exists(path):
            self._refuse_others(path)
            return
        if exists(self.folder / PARTS):
            raise InputError(
                "there is a folder of this name, and nothing says whose it is",
                parameter="out",
                where=str(self.folder / PARTS),
                cure="Choose another `out`.",
            )

    def begin(self) -> None:
        """Write down what is asked, where it does not stand there yet."""
        path = self.folder / RECORD
        if not exists(path):
            write_text(path, json.dumps(self._record(), indent=1, default=str) + "\n")
        self.check()

    def _record(self) -> dict[str, Any]:
        asked = self.manifest
        return {
            "truearm": _RECORD_SCHEMA,
            "version": __version__,
            "digest": asked.digest,
            "robots": asked.count,
            "chunk": asked.chunk,
            "parts": asked.parts,
            "manifest": asked.content,
            "files": asked.hashes,
        }

    def _refuse_others(self, path: Path) -> None:
        try:
            known = json.loads(read_text(path))
            schema = known["truearm"] if isinstance(known, dict) else None
        except (ValueError, KeyError):
            known, schema = {}, None
        if schema != _RECORD_SCHEMA:
            raise InputError("this is no record of a fleet", parameter="out", where=str(path), cure="Choose another.")
        another = "Choose another `out`, or give what was asked there."
        if known.get("version") != __version__:
            raise InputError(
                "the parts there were computed by another version of truearm",
                parameter="out",
                where=str(self.folder),
                came=known.get("version"),
                allowed=__version__,
                cure="Choose another `out`, or go on with that version.",
            )
        if known.get("digest") == self.manifest.digest:
            return
        files = known.get("files", {})
        changed = [name for name, hash_ in self.manifest.hashes.items() if files.get(name, hash_) != hash_]
        if changed and json.dumps(known.get("manifest")) == json.dumps(self.manifest.content, default=str):
            raise InputError(
                "this file has changed since parts there were computed from it",
                parameter="out",
                where=str(self.folder),
                came=changed[0],
                cure=another,
            )
        raise InputError(
            "the parts there are of another manifest", parameter="out", where=str(self.folder), cure=another
        )

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Let no other run work in the folder; the lock ends with the process, however that ends.

        Raises
        ------
        InputError
            If another one does.
        """
        if sys.platform == "win32":
            yield
            return
        import fcntl

        with (self.folder / RECORD).open("rb") as stream:
            try:
                fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                raise InputError(
                    "another run computes parts there",
                    parameter="out",
                    where=str(self.folder),
                    cure="Wait until it has finished, or choose another `out`.",
                ) from error
            except OSError:  # a file system without locks
                pass
            yield

    def done(self) -> set[int]:
        """Return which parts are on disk, counted from 0."""
        names = {path.name for path in (self.folder / PARTS).glob("*/*.jsonl")}
        return {part for part in range(self.manifest.parts) if self.file(part).name in names}

    def write(self, part: int, text: str) -> None:
        """Write a part that is done, as a whole or not at all; `text` as of :func:`part_text`."""
        first, _, rest = text.partition("\n")
        head = {
            "truearm": _PART_SCHEMA,
            "digest": self.manifest.digest,
            "part": part + 1,
            "robots": len(self.manifest.numbers(part)),
            **json.loads(first),
        }
        write_text(self.file(part), json.dumps(head) + "\n" + rest)

    def rows(self) -> Iterator[Row]:
        """Read the robots of all parts that are done, in their order, a part at a time.

        Raises
        ------
        InputError
            Naming the part that somebody has changed.
        """
        for part in sorted(self.done()):
            yield from self._rows(part)

    def _rows(self, part: int) -> list[Row]:
        path = self.file(part)
        head, *lines = read_text(path).splitlines()
        try:
            said = from_json(head)
            rows = [Row.read(from_json(line), said["shared"]) for line in lines]
            ours = said["truearm"] == _PART_SCHEMA and said["digest"] == self.manifest.digest
            names = [row.name for row in rows]
        except (ValueError, KeyError, TypeError):
            ours, names = False, []
        if not ours or names != self.manifest.names(part):
            raise InputError(
                "this part of the fleet is not as it was written",
                parameter="out",
                where=str(path),
                cure="Remove it and run this again: it is computed anew.",
            )
        return rows
