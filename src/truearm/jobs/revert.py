"""The originals of corrected programs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from truearm.compensation.program_files import restored
from truearm.errors import refusals_of
from truearm.jobs.arguments import folder_for, paths_argument
from truearm.results.restored_programs import RestoredPrograms


def revert(programs: Sequence[str | Path], *, out: str | Path | None = None) -> RestoredPrograms:
    """Restore the originals of corrected programs from the records beside them.

    Parameters
    ----------
    programs
        Corrected programs.
    out
        Folder for the originals; None writes nothing.

    Raises
    ------
    InputError
        If a program has no record or was changed since, or a file would be overwritten.
    """
    paths = paths_argument(programs, "programs", "program")
    folder = None if out is None else folder_for((path.name for path in paths), out, *paths)
    with refusals_of("programs"):
        made = RestoredPrograms(restored(paths))
    if folder is None:
        return made
    with refusals_of("out"):
        made.save(folder)
    return replace(made, folder=folder)
