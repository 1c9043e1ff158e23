"""Targets that are corrected already, known by their numbers in whatever program they stand now.

A corrected target has numbers that no original has. So the record of a corrected program, and a ledger beside the file
of the robot that it was corrected for, keep digests of its targets: those that its original does not have. A program
that has been renamed, copied elsewhere or edited since, and whose comment was removed, is known by them. What a
correction leaves as it was is in no digest, so originals and programs that share such targets are none.

A digest is of the position, rounded to a hundredth of a millimetre, or of the joint positions, rounded to a thousandth
of a degree or to pulses: a controller that writes the program anew with fewer or more decimals does not change it.
"""

from __future__ import annotations

import base64
import binascii
import json
from collections.abc import Iterable, Sequence
from contextlib import suppress
from hashlib import blake2b
from itertools import product
from pathlib import Path
from typing import Annotated, Final, Literal, NamedTuple

from pydantic import AfterValidator, BaseModel, ConfigDict

from truearm.engine.base.errors import InputError
from truearm.engine.base.files import exists, read_bytes
from truearm.engine.base.manifest import hash_of
from truearm.engine.base.schemas import validated
from truearm.engine.base.writing import write_text_over
from truearm.engine.programs.correction import Correction
from truearm.engine.programs.program import ProgramTarget

#: The ledger beside a robot's file.
LEDGER: Final = "truearm.corrected.json"
_SCHEMA: Final = "truearm-corrections/1"
#: Bytes of a digest: among a million targets, two that differ have the same one once in 300 million cases.
_SIZE: Final = 6
#: So many digests are kept of a program, the smallest: a sample that any other program can be compared with.
_MOST: Final = 1000
#: A program is corrected already if one of so many of its targets is: single points of a dense path may coincide.
_ONE_IN: Final = 20
#: Beyond this part of a step, a number that was written with other decimals may be rounded to the next one.
_NEAR: Final = 0.45


def _packed(text: str) -> str:
    try:
        size = len(base64.b64decode(text, validate=True))
    except (binascii.Error, ValueError):
        size = 1
    if size % _SIZE:
        raise InputError(
            "these are no digests of targets", came=text, allowed="base64", cure="Restore the file as it was written."
        )
    return text


#: Digests of targets, one after the other, as files hold them.
Digests = Annotated[str, AfterValidator(_packed)]


class LedgerEntry(BaseModel):
    """A program that was corrected: its name, the day, for which robot, and the digests of its targets."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    program: str
    date: str
    robot: str
    targets: Digests


class _Ledger(BaseModel):
    """Schema ``truearm-corrections/1``: programs that were corrected for the robots of a folder."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    truearm: Literal["truearm-corrections/1"]
    programs: tuple[LedgerEntry, ...]


class KnownCorrection(NamedTuple):
    """What is known of a program that was corrected: its name, the day, the digests, and the file that says so."""

    program: str
    date: str
    targets: str
    where: Path


def corrected_digests(original: Iterable[ProgramTarget], corrected: Iterable[ProgramTarget]) -> str:
    """Return the digests of the targets of a corrected program that its original does not have."""
    old = {digest for target in original if target.parent is None for digest in _digests(target)}
    new = {_digests(target)[0] for target in corrected if target.parent is None} - old
    return base64.b64encode(b"".join(sorted(new)[:_MOST])).decode()


def refuse_corrected(corrections: Sequence[Correction], known: Sequence[KnownCorrection]) -> None:
    """Refuse programs of which targets would be corrected that are corrected already.

    Raises:
        InputError: If at least one of twenty targets that would be corrected in a file is among those of a known
            program.
    """
    entries = [(other, _unpacked(other.targets)) for other in known if other.targets]
    for correction in corrections if entries else ():
        for number, source in enumerate(correction.program.sources):
            lines: dict[bytes, int] = {}
            own = []
            for row, target in enumerate(correction.program.targets):
                if target.source == number and target.parent is None and correction.corrected[row]:
                    digests = _digests(target)
                    own.append(digests[0])
                    lines |= dict.fromkeys(digests, target.line)
            for other, digests_of_other in entries:
                matched_lines = {lines[digest] for digest in digests_of_other if digest in lines}
                last = digests_of_other[-1] if len(digests_of_other) == _MOST else b"\xff" * _SIZE
                if matched_lines and _ONE_IN * len(matched_lines) >= sum(digest <= last for digest in own):
                    raise InputError(
                        "this program was corrected already",
                        where=source.where(min(matched_lines)),
                        came=f"targets of {other.program} as it was corrected{_on(other.date)}, says {other.where}",
                        cure="Give the original, or leave these targets as they are with `keep`.",
                    )


def _on(date: str) -> str:
    return f" on {date}" if date else ""


def _unpacked(text: str) -> list[bytes]:
    packed = base64.b64decode(text)
    return [packed[place : place + _SIZE] for place in range(0, len(packed), _SIZE)]


def _digests(target: ProgramTarget) -> list[bytes]:
    """Return the digest of a target, and those that it may have where it is written with other decimals."""
    form, values = target.form, target.values
    if form.kind == "pose":
        values, step = values[:3], 10.0 ** (1 - form.decimals[0])
    else:
        step = 1.0 if form.kind == "pulses" else 10.0 ** (1 - form.decimals[1])
    steps = []
    for value in values:
        nearest = round(value / step)
        off = value / step - nearest
        steps.append((nearest, nearest + (1 if off > 0.0 else -1)) if abs(off) > _NEAR else (nearest,))
    return [blake2b(f"{form.kind}{key}".encode(), digest_size=_SIZE).digest() for key in product(*steps)]


# -- the ledger -------------------------------------------------------------------------------------------


def ledger_beside(robot: Path) -> Path:
    """Return where the ledger of a robot's file is, links followed."""
    return robot.resolve().parent / LEDGER


def known_by_ledger(ledger: Path) -> list[KnownCorrection]:
    """Return what a ledger says, and those of the folders beside: there are other calibrations of the same robot.

    Raises:
        InputError: If what has the name of the ledger is none.
    """
    corrections = [*_known(ledger)]
    beside = {other.resolve() for other in ledger.parent.parent.glob(f"*/{LEDGER}")}
    for other in sorted(beside - {ledger.resolve()}):
        with suppress(InputError):  # of another robot, perhaps
            corrections += _known(other)
    return corrections


def _known(ledger: Path) -> list[KnownCorrection]:
    content = read_bytes(ledger) if exists(ledger) else None
    return [KnownCorrection(entry.program, entry.date, entry.targets, ledger) for entry in _entries(content, ledger)]


def remember(ledger: Path, programs: Sequence[LedgerEntry]) -> None:
    """Add programs to a ledger, as a whole; what another run adds meanwhile stays.

    Raises:
        InputError: If what has its name is no ledger, or it cannot be written.
    """
    while True:
        content = read_bytes(ledger) if exists(ledger) else None
        entries = _entries(content, ledger)
        known_targets = {entry.targets for entry in entries}
        new = [program for program in programs if program.targets and program.targets not in known_targets]
        if not new:
            return
        text = json.dumps({"truearm": _SCHEMA, "programs": [p.model_dump() for p in (*entries, *new)]}, indent=1)
        try:
            write_text_over(ledger, text + "\n", None if content is None else hash_of(content))
        except InputError:
            if (read_bytes(ledger) if exists(ledger) else None) == content:
                raise
        else:
            return


def _entries(content: bytes | None, ledger: Path) -> tuple[LedgerEntry, ...]:
    if content is None:
        return ()
    try:
        return validated(json.loads(content), _Ledger, str(ledger)).programs
    except (InputError, ValueError, RecursionError) as error:
        raise InputError(
            f"truearm writes a file of this name itself, and this is not one: schema {_SCHEMA}",
            where=str(ledger),
            cure="Restore it. Without it, copies of programs corrected for the robots of this folder are not known.",
        ) from error
