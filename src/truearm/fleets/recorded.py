"""The parts of a fleet on disk: written once, never computed twice, and read robot by robot.

``record.json`` says what is asked; ``parts/``, which a run locks, holds a file for each part that is done: a line of
JSON with what its robots share, one for each robot, and one with the hash of those before. A file is there as a whole
or not at all.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from pydantic_core import from_json

from truearm.engine.base.errors import InputError, counted, listed
from truearm.engine.base.files import exists, read_bytes, read_text, reason_of
from truearm.engine.base.manifest import hash_of
from truearm.engine.base.version import __version__
from truearm.engine.base.writing import locked, write_text
from truearm.fleets.manifest import Manifest
from truearm.fleets.part_schema import head_of, rows_of, said_of
from truearm.fleets.series import Row

RECORD: Final = "record.json"
PARTS: Final = "parts"
#: Folder of a fleet for the folders of its robots.
ROBOTS: Final = "robots"
_RECORD_SCHEMA: Final = "truearm-fleet-record/1"
_PART_SCHEMA: Final = "truearm-fleet-part/1"
#: Files of a folder at most.
_TOGETHER: Final = 1000


def refuse_link(folder: Path) -> None:
    """Refuse a link where a folder of the fleet belongs."""
    if folder.is_symlink():
        raise InputError(
            "this is a link, and the folder itself belongs here",
            parameter="out",
            where=str(folder),
            cure="Remove the link, or choose another `out`.",
        )


@dataclass(frozen=True)
class Known:
    """Which parts of a fleet are on disk."""

    finished: frozenset[int]  #: Numbers of those that are not computed again, counted from 0.
    again: tuple[str, ...] = ()  #: Why others are, in plain words.


@dataclass(frozen=True)
class Recorded:
    """The parts of a fleet in a folder."""

    folder: Path  #: Where they are.
    manifest: Manifest  #: What is asked.
    _keys: dict[int, str] = field(default_factory=dict, init=False, repr=False, compare=False)

    def file(self, part: int) -> Path:
        """Return where a part is, counted from 0."""
        return self.folder / PARTS / f"{part // _TOGETHER:04}" / f"{part + 1:07}.jsonl"

    def _refuse_links(self) -> None:
        for name in (PARTS, ROBOTS):
            refuse_link(self.folder / name)

    def _recorded(self) -> dict[str, Any] | None:
        """Return what the record says; None where there is none, and no parts that it could be of."""
        if exists(self.folder / RECORD):
            known = self._read()
            self._refuse_others(known)
            return known
        parts = self.folder / PARTS
        if exists(parts) and (not parts.is_dir() or any(parts.iterdir())):
            raise InputError(
                "there is a folder of this name, and nothing says whose it is",
                parameter="out",
                where=str(parts),
                cure="Choose another `out`.",
            )
        return None

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

    def _read(self) -> dict[str, Any]:
        path = self.folder / RECORD
        try:
            known = json.loads(read_text(path))
            schema = known["truearm"] if isinstance(known, dict) else None
        except (ValueError, KeyError):
            known, schema = {}, None
        if schema != _RECORD_SCHEMA:
            raise InputError("this is no record of a fleet", parameter="out", where=str(path), cure="Choose another.")
        return dict(known)

    def _refuse_others(self, known: Mapping[str, Any]) -> None:
        if known.get("version") != __version__:
            raise InputError(
                "the parts there were computed by another version of truearm",
                parameter="out",
                where=str(self.folder),
                came=known.get("version"),
                allowed=__version__,
                cure="Choose another `out`, or go on with that version.",
            )
        if known.get("digest") == self.manifest.digest or self._goes_on(known):
            return
        another = "Choose another `out`, or give what was asked there."
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
            "the parts there are of another manifest",
            parameter="out",
            where=str(self.folder),
            cure=another
            if self.manifest.experiment is not None
            else "Choose another `out`. Only a manifest with the same robots in the same order, and more behind them, "
            "and with the same 'chunk', goes on there.",
        )

    def _goes_on(self, known: Mapping[str, Any]) -> bool:
        """Return whether the manifest is that of the record with entries corrected, and robots added behind them."""
        if self.manifest.experiment is not None or known.get("chunk") != self.manifest.chunk:
            return False
        try:
            names = [str(robot["name"]) for robot in known["manifest"]["robots"]]
        except (KeyError, TypeError):
            return False
        return bool(names) and names == [robot.name for robot in self.manifest.robots[: len(names)]]

    @contextmanager
    def alone(self) -> Iterator[Known]:
        """Let no other run work in the folder, and return what is done there; the lock ends with the process.

        What is asked is written down where nothing stands there yet. Where entries of the manifest have been corrected,
        the parts that they are in are removed.

        Raises:
            InputError: If another run works there, something else was asked there, or somebody has changed a part.
        """
        self._refuse_links()
        try:
            (self.folder / PARTS).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(
                f"the folder cannot be made ({reason_of(error)})", parameter="out", where=str(self.folder / PARTS)
            ) from error
        with self._locked():
            known = self._recorded()
            removed: tuple[str, ...] = ()
            if known is None or known.get("digest") != self.manifest.digest:
                removed = self._remove_corrected() if known is not None else ()
                write_text(self.folder / RECORD, json.dumps(self._record(), indent=1, default=str) + "\n")
            parts = self.known()
            yield Known(parts.finished, (*removed, *parts.again))

    def _remove_corrected(self) -> tuple[str, ...]:
        """Remove the parts with robots whose entries or files are others than they were computed from."""
        removed = []
        for part in self.on_disk():
            head = self._head(read_bytes(self.file(part)), part)
            if head.get("key") != self._key(part):
                self.file(part).unlink()
                removed.append(part)
        if not removed:
            return ()
        names = [name for part in removed for name in self.manifest.names(part)]
        return (
            f"{counted(len(removed), 'part')} computed again, because the manifest or files of it have changed: "
            f"{listed(names)}",
        )

    @contextmanager
    def _locked(self) -> Iterator[None]:
        """Lock the folder of the parts, which is never replaced, as the record is that every run may write."""
        with locked(self.folder / PARTS, wait=False) as alone:
            if not alone:
                raise InputError(
                    "another run computes parts there",
                    parameter="out",
                    where=str(self.folder),
                    cure="Wait until it has finished, or choose another `out`.",
                )
            yield

    def known(self) -> Known:
        """Return which parts are on disk.

        A part of which files have been removed, or whose data changed while it was computed, is computed again.

        Raises:
            InputError: Naming a part that somebody has changed.
        """
        finished, again = set[int](), list[str]()
        for part in self.on_disk():
            head = self._checked(part)[0]
            gone = [name for name in head["written"] if not exists(self.folder / name)]
            if head["changed"]:
                again.append(
                    f"1 part computed again, because files changed while it was computed: {listed(head['changed'])}"
                )
            elif gone:
                again.append(f"1 part computed again, because files of it are missing: {listed(gone)}")
            else:
                finished.add(part)
        return Known(frozenset(finished), tuple(again))

    def missing(self) -> int:
        """Return how many parts are to be computed; all of them where another manifest goes on.

        Raises:
            InputError: As :meth:`alone`, and for other files that stand there.
        """
        self._refuse_links()
        if not exists(self.folder / PARTS):
            self._recorded()
            return self.manifest.parts
        with self._locked():
            known = self._recorded()
            same = known is not None and known.get("digest") == self.manifest.digest
            return self.manifest.parts - (len(self.known().finished) if same else 0)

    def on_disk(self) -> list[int]:
        """Return which parts have a file, in their order."""
        names = {path.name for path in (self.folder / PARTS).glob("*/*.jsonl")}
        return [part for part in range(self.manifest.parts) if self.file(part).name in names]

    def write(self, part: int, text: str) -> None:
        """Write a part that is done, as a whole or not at all.

        Args:
            text: As of :func:`truearm.fleets.series.part_text`.

        Raises:
            ValueError: If it is not what belongs to the robots of this part: then nothing is written.
        """
        first, _, lines = text.encode().partition(b"\n")
        stated = said_of(first)
        self._refuse_foreign(part, stated)
        self._validated(part, stated, lines)
        head = {
            "truearm": _PART_SCHEMA,
            "key": self._key(part),
            "part": part + 1,
            "robots": len(self.manifest.numbers(part)),
            **stated,
        }
        whole = f"{json.dumps(head)}\n{lines.decode()}"
        write_text(self.file(part), f"{whole}{json.dumps({'sha256': hash_of(whole.encode())})}\n")

    def rows(self) -> Iterator[Row]:
        """Read the robots of all parts that are on disk, in their order, a part at a time.

        Raises:
            InputError: Naming the part that somebody has changed.
        """
        for part in self.on_disk():
            yield from self._rows(part)

    def _rows(self, part: int) -> list[Row]:
        head, lines = self._checked(part)
        try:
            return self._validated(part, head, lines)
        except (ValueError, TypeError, RecursionError) as error:
            raise self._not_ours(part) from error

    def _validated(self, part: int, head: Mapping[str, Any], lines: bytes) -> list[Row]:
        """Return the robots of a part, or raise ValueError if they are not those that the manifest has there."""
        shared = {kind: tuple(column) for kind, column in head["shared"].items()}
        rows = [Row.read(row, shared) for row in rows_of(lines)]
        if [(row.name, row.of, row.date) for row in rows] != self.manifest.identities(part):
            raise ValueError("these are other robots")
        return rows

    def _refuse_foreign(self, part: int, head: Mapping[str, Any]) -> None:
        """Raise ValueError where the first line names other robots, or files that are none of theirs."""
        names = self.manifest.names(part)
        if not {*head["changed"]} <= {*names}:
            raise ValueError("these are other robots")
        if self.manifest.experiment is not None and (head["written"] or head["changed"]):
            raise ValueError("of simulated robots nothing is written")
        ours = {f"{ROBOTS}/{name}" for name in names}
        for name in head["written"]:
            folder, _, file = name.rpartition("/")
            if folder not in ours or file in ("", ".", "..") or not file.isprintable():
                raise ValueError("files of others")

    def _checked(self, part: int) -> tuple[dict[str, Any], bytes]:
        """Return the first line of a part and the lines of its robots, or refuse what is not as it was written."""
        content = read_bytes(self.file(part))
        whole, _, last = content.removesuffix(b"\n").rpartition(b"\n")
        head = self._head(content, part)
        try:
            stated_hash = from_json(last)["sha256"]
            self._refuse_foreign(part, head)
        except (ValueError, KeyError, TypeError) as error:
            raise self._not_ours(part) from error
        if stated_hash != hash_of(whole + b"\n") or head["key"] != self._key(part):
            raise self._not_ours(part)
        if (head["part"], head["robots"]) != (part + 1, len(self.manifest.numbers(part))):
            raise self._not_ours(part)
        return head, (whole + b"\n").partition(b"\n")[2]

    def _head(self, content: bytes, part: int) -> dict[str, Any]:
        try:
            return head_of(content.partition(b"\n")[0])
        except (ValueError, RecursionError) as error:
            raise self._not_ours(part) from error

    def _key(self, part: int) -> str:
        """Return the hash of what is asked of a part."""
        if part not in self._keys:
            self._keys[part] = self.manifest.key(part)
        return self._keys[part]

    def _not_ours(self, part: int) -> InputError:
        return InputError(
            "this part of the fleet is not as it was written",
            parameter="out",
            where=str(self.file(part)),
            cure="Remove it and run this again: it is computed anew.",
        )
