"""Program files: read, corrected, written beside a record of what was done, and restored from it.

Beside every program that is written stands ``NAME.truearm.json``: hashes of the program before and after, what was
applied, digests of its targets (:mod:`truearm.engine.programs.corrected_targets`), and the original itself. A program
with such a record has been corrected already, and so has one with the comment that corrected programs carry.
"""

from __future__ import annotations

import base64
import gc
import json
import os
import re
import zlib
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict

from truearm.engine.base.errors import InputError
from truearm.engine.base.files import exists, read_bytes
from truearm.engine.base.limits import limit, refuse_beyond
from truearm.engine.base.manifest import hash_of, sets_in
from truearm.engine.base.schemas import validated
from truearm.engine.base.writing import refuse_overwriting, write_files
from truearm.engine.programs import LANGUAGES
from truearm.engine.programs.corrected_targets import Digests, KnownCorrection, LedgerEntry, remember
from truearm.engine.programs.program import Edit, Language, Program, Source, comment_of, replaced

SCHEMA: Final = "truearm-corrected/1"


def _of_a_file(text: str) -> str:
    if not re.fullmatch("[0-9a-f]{64}", text):
        raise InputError(
            "this is not the SHA-256 of a file",
            came=text,
            allowed="64 digits, 0 to 9 and a to f",
            cure="Restore the record as it was written.",
        )
    return text


Hash = Annotated[str, AfterValidator(_of_a_file)]


class CorrectionRecord(BaseModel):
    """Schema ``truearm-corrected/1``: what was done to a program."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    truearm: Literal["truearm-corrected/1"]
    program: str
    language: str
    original_sha256: Hash
    corrected_sha256: Hash
    applied: dict[str, Any]
    original: str
    date: str = ""
    targets: Digests = ""


@dataclass(frozen=True)
class ProgramFile:
    """A program file as it was found."""

    path: Path  #: Where it was found.
    name: str  #: What it is called in the folder of results: its name, with folders where two would have the same.
    original: bytes = field(repr=False)  #: Its bytes before any correction.


def record_path(program: Path) -> Path:
    """Return the path of the record beside a program."""
    return program.with_name(f"{program.name}.truearm.json")


def program_files(paths: Sequence[Path], *, again: bool = False) -> tuple[ProgramFile, ...]:
    """Read program files, and those that belong to them.

    Args:
        again: Take the original of a program that was corrected already, out of its record.

    Raises:
        InputError: If a file cannot be read, is no text or too large, is given twice, or was corrected already.
    """
    every = [*paths]
    for path in paths:
        every += [near for near in companions(path) if not any(_same(near, other) for other in every)]
    _refuse_twice(every)
    names = _names(every)
    return tuple(ProgramFile(path, name, _original(path, again)) for path, name in zip(every, names, strict=True))


def _refuse_twice(paths: Sequence[Path]) -> None:
    for number, path in enumerate(paths):
        if any(_same(path, other) for other in paths[:number]):
            raise InputError("this program is given twice", where=str(path))


def restored(paths: Sequence[Path]) -> tuple[ProgramFile, ...]:
    """Return the originals of corrected programs, out of their records.

    Raises:
        InputError: If a program has no record, was changed after it was written, or is given twice.
    """
    _refuse_twice(paths)
    files = []
    for path, name in zip(paths, _names(paths), strict=True):
        record = correction_record(path)
        if record is None:
            raise InputError(
                "there is no record beside this program, so nothing to restore it from",
                where=str(path),
                allowed=str(record_path(path)),
            )
        files.append(ProgramFile(path, name, _unchanged_original(path, record)))
    return tuple(files)


def read_programs(files: Sequence[ProgramFile]) -> tuple[Program, ...]:
    """Find targets and moves in program files of one language.

    Raises:
        InputError: If the files are of several languages or of none, or one of them is malformed.
    """
    languages = [_language(file) for file in files]
    other = next((i for i, language in enumerate(languages) if language is not languages[0]), None)
    if other is not None:
        raise InputError(
            "the programs are in different languages, and a robot speaks one",
            where=str(files[other].path),
            came=languages[other].name,
            allowed=f"{languages[0].name}, as {files[0].path}",
            cure="Correct them one after the other, each with its own robot.",
        )
    language = languages[0]
    return read_sources(language, [Source(file.path, file.original.decode("latin-1")) for file in files])


def read_sources(language: Language, sources: Sequence[Source]) -> tuple[Program, ...]:
    """Find targets and moves in the texts of programs of a language.

    Raises:
        InputError: If one of them is malformed.
    """
    # Hundreds of thousands of targets are made that all stay: the collector would look through them again and again.
    collecting = gc.isenabled()
    gc.disable()
    try:
        return language.programs(sources)
    finally:
        if collecting:
            gc.enable()


def language_called(name: str) -> Language:
    """Return the language of a program by its name."""
    return next(language for language in LANGUAGES if language.name == name)


def edited(text: str, edits: Sequence[Edit]) -> str:
    """Return a text with edits made that do not overlap."""
    return replaced(text, 0, len(text), [(edit.start, edit.stop, edit.text) for edit in edits])


def recorded(
    file: ProgramFile,
    corrected: bytes,
    language: str,
    applied: Mapping[str, Any],
    date: str = "",
    targets: Digests = "",
) -> str:
    """Return the text of the record of a program that was corrected on a day, with the digests of its targets."""
    content = CorrectionRecord(
        truearm=SCHEMA,
        program=Path(file.name).name,
        language=language,
        original_sha256=hash_of(file.original),
        corrected_sha256=hash_of(corrected),
        applied=dict(applied),
        original=base64.b64encode(zlib.compress(file.original, 9)).decode(),
        date=date,
        targets=targets,
    )
    return json.dumps(content.model_dump(), indent=1) + "\n"


def known_by_records(folders: Iterable[Path]) -> list[KnownCorrection]:
    """Return what the records in some folders say of corrected programs, whatever these are called now."""
    known = []
    for path in sorted({path for folder in folders for path in folder.glob("*.truearm.json")}):
        with suppress(InputError):  # of another program: what it says cannot be known
            record = correction_record(path.with_name(path.name.removesuffix(".truearm.json")))
            if record is not None:
                known.append(KnownCorrection(record.program, record.date, record.targets, path))
    return known


def write_programs(
    folder: Path,
    inputs: Sequence[Path],
    files: Mapping[str, str | bytes],
    command: str | None = None,
    ledger: tuple[Path, Sequence[LedgerEntry]] | None = None,
) -> None:
    """Write results into a folder, all of them or none. Records replace earlier ones.

    The ledger is written first, then records are put in place: there is never a corrected program that they do not
    know, and which could be corrected once more.

    Raises:
        InputError: If a program would be overwritten that was read, or that truearm has not written itself, or one
            without a record would be written beside the record of another.
    """
    read = [*inputs, *map(record_path, inputs)]
    for name, content in files.items():
        path = folder / name
        refuse_overwriting(path, read)
        report = name.endswith(".html") and exists(path)
        if report and all(file_set.files.get(name) != hash_of(read_bytes(path)) for file_set in sets_in(folder)):
            raise _foreign_file(path)
        if name.endswith(".truearm.json"):
            _refuse_losing(path)
        if name.endswith((".truearm.json", ".html")):
            continue
        if exists(record_path(path)) and f"{name}.truearm.json" not in files:
            raise InputError(
                "a record of a correction stands here, and would be taken for one of this program",
                where=str(record_path(path)),
                cure="Choose another `out`.",
            )
        if not exists(path):
            continue
        present = read_bytes(path)
        record = correction_record(path)
        new = content if isinstance(content, bytes) else content.encode()
        if present != new and (record is None or record.corrected_sha256 != hash_of(present)):
            raise _foreign_file(path)
    if ledger is not None:
        remember(*ledger)
    order = sorted(files, key=lambda name: not name.endswith(".truearm.json"))
    write_files(folder, {name: files[name] for name in order}, command)


def _refuse_losing(record: Path) -> None:
    """Refuse to replace a record that is somebody else's, or that holds the original of a program that is not there."""
    if not exists(record):
        return
    program = record.with_name(record.name.removesuffix(".truearm.json"))
    try:
        known = correction_record(program)
    except InputError as error:
        raise _foreign_file(record) from error
    if known is not None and not exists(program):
        raise InputError(
            "this record holds the original of a program that is not beside it, and is not overwritten",
            where=str(record),
            cure="Choose another `out`.",
        )


def _foreign_file(path: Path) -> InputError:
    return InputError(
        "this file exists already, was not written by truearm or was changed since, and is not overwritten",
        where=str(path),
        cure="Choose another `out`.",
    )


# -- reading ----------------------------------------------------------------------------------------------


def _original(path: Path, again: bool) -> bytes:
    record = correction_record(path)
    if record is None:
        content = _text_bytes(path)
        comment = comment_of(content.decode("latin-1"))
        if comment is not None:
            raise InputError(
                "this program was corrected already",
                where=str(path),
                came=f"the comment '{comment}'",
                cure="Give the original. A program that 'truearm path' wrote has no original: run it as it is.",
            )
        return content
    if not again and record.corrected_sha256 != record.original_sha256:  # otherwise nothing was corrected in it
        raise InputError(
            "this program was corrected already",
            where=str(path),
            came=f"the record {record_path(path).name}",
            cure="Give the original; or correct that original anew with `again`, or restore it with `revert`.",
        )
    return _unchanged_original(path, record)


def _unchanged_original(path: Path, record: CorrectionRecord) -> bytes:
    if hash_of(_text_bytes(path)) != record.corrected_sha256:
        raise InputError(
            "this program was changed after it was corrected, so its record is no longer about it",
            where=str(path),
            cure="Make the change in the original, which the record holds, and correct that. If this is another "
            f"program, move it away from {record_path(path).name}.",
        )
    original = _unpacked(record.original, record_path(path))
    if hash_of(original) != record.original_sha256:
        raise InputError("the original in this record is damaged", where=str(record_path(path)))
    return original


def _unpacked(packed: str, record: Path) -> bytes:
    """Return the original that a record holds packed, nothing if it is damaged; refuse one larger than programs are."""
    unpacking = zlib.decompressobj()
    try:
        original = unpacking.decompress(base64.b64decode(packed, validate=True), limit("program_size") + 1)
    except (ValueError, zlib.error):
        return b""
    refuse_beyond("program_size", len(original), where=f"{record}, original")
    return original if unpacking.eof else b""


def correction_record(path: Path) -> CorrectionRecord | None:
    """Return the record beside a program; None if there is none, so that nobody has corrected it.

    Raises:
        InputError: If the program is a folder, or the record cannot be read.
    """
    if path.is_dir():
        raise InputError("this is a folder, a program is needed", where=str(path), cure="Name the files in it.")
    beside = record_path(path)
    if not exists(beside):
        return None
    text = read_bytes(beside)
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError("this record cannot be read", where=str(beside), cure="Remove it, or restore it.") from error
    return validated(content, CorrectionRecord, str(beside))


def _text_bytes(path: Path) -> bytes:
    content = read_bytes(path, "program_size")
    if not content.strip():
        raise InputError("the file is empty", where=str(path))
    if b"\0" in content:
        wide = content[:2] in (b"\xff\xfe", b"\xfe\xff")
        raise InputError(
            "this is no program text: it is UTF-16" if wide else "this is no program text: it has zero bytes",
            where=str(path),
            cure="Save it as UTF-8." if wide else "Export the program as text from the controller or its software.",
        )
    return content


def _language(file: ProgramFile) -> Language:
    suffix = file.path.suffix.lower()
    text = file.original.decode("latin-1")
    for language in LANGUAGES:
        if suffix in language.suffixes:
            if language.recognizes(text):
                return language
            others = [other.name for other in LANGUAGES if other is not language and other.recognizes(text)]
            raise InputError(
                f"the file is called as a program in {language.name} and is none",
                where=str(file.path),
                came=f"what looks like {' or '.join(others)}" if others else None,
                cure="Check what was exported.",
            )
    raise InputError(
        "no robot language has files of this kind",
        where=str(file.path),
        came=suffix or "no suffix",
        allowed="; ".join(f"{language.name} ({', '.join(language.suffixes)})" for language in LANGUAGES),
    )


def companions(path: Path) -> list[Path]:
    """Return files beside a program that belong to it by their name."""
    suffix = path.suffix.lower()
    pairs = [pair for language in LANGUAGES for pair in language.companions if suffix == pair[0]]
    try:
        siblings = [p for p in path.parent.iterdir() if p.stem.lower() == path.stem.lower()] if pairs else []
    except OSError:
        siblings = []
    return [p for _, other in pairs for p in siblings if p.suffix.lower() == other]


def _same(path: Path, other: Path) -> bool:
    try:
        return path.samefile(other)
    except (OSError, ValueError):
        return path == other


def _names(paths: Sequence[Path]) -> list[str]:
    """Return the names of results: of paths with one name as much of their folders as tells them apart."""
    parts = [Path(os.path.normpath(path.absolute())).parts[1:] for path in paths]  # without .. on the way
    names = []
    for own in parts:
        alike = [other for other in parts if other != own and other[-1].lower() == own[-1].lower()]
        depth = 2 if alike else 1
        while any(other[-depth:] == own[-depth:] for other in alike):
            depth += 1
        names.append("/".join(own[-depth:]))
    return names
