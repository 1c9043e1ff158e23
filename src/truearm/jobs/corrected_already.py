"""Programs that were corrected already: where that is looked for, and where it is remembered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path

from truearm.compensation.corrected_targets import known_by_ledger, ledger_beside, refuse_corrected
from truearm.compensation.program_correction import CorrectedPrograms
from truearm.compensation.program_files import known_by_records
from truearm.errors import InputError, refusals_of
from truearm.files import exists
from truearm.notices import Notice
from truearm.writing import writable_folder


def refuse_corrected_already(
    result: CorrectedPrograms, paths: Sequence[Path], folder: Path | None, ledger: Path | None
) -> None:
    """Refuse programs with targets that are corrected already.

    Records are looked for beside the programs and in the folder of results, whatever programs are called there.

    Raises:
        InputError: If there are such targets, or the ledger cannot be read.
    """
    folders = {*(path.parent for path in paths), *([] if folder is None else [folder])}
    with refusals_of("robot"):
        known = [] if ledger is None else known_by_ledger(ledger)
    with refusals_of("programs"):
        refuse_corrected(result.corrections, [*known_by_records(folders), *known])


def ledger_of(robot: object) -> Path | None:
    """Return where the ledger of a robot is that was given by its file; None for any other."""
    if not isinstance(robot, str | Path) or not exists(Path(robot)) or Path(robot).is_dir():
        return None
    return ledger_beside(Path(robot))


def ledger_to_write(ledger: Path | None) -> tuple[Path | None, list[Notice]]:
    """Return the ledger if it can be written, and say so if it cannot."""
    if ledger is None:
        return None, []
    try:
        writable_folder(ledger.parent)
    except InputError:
        message = (
            f"{ledger} cannot be written. A copy of these programs may not be known as corrected once its comment is "
            "removed."
        )
        return None, [Notice("ledger-not-written", message, "note")]
    return ledger, []


def day_of(notes: Mapping[str, str]) -> date:
    """Return the day that was noted as the date, today if there is none."""
    try:
        return date.fromisoformat(notes.get("date", ""))
    except ValueError:
        return date.today()
