"""The originals of corrected programs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from truearm.compensation.program_files import ProgramFile, write_programs
from truearm.results.record import Record
from truearm.writing import output_folder


@dataclass(frozen=True, eq=False, repr=False)
class RestoredPrograms(Record):
    """The originals of corrected programs, out of the records beside them."""

    files: tuple[ProgramFile, ...]  #: One a program, with its original.
    folder: Path | None = None  #: Where the originals were written; None if they were not.

    @property
    def paths(self) -> tuple[Path, ...]:
        """Where the originals were written, or their names if they were not."""
        return tuple((self.folder or Path()) / file.name for file in self.files)

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        return {"reverted": [str(path) for path in self.paths]}

    def lines(self) -> list[str]:
        """Return a line for each program."""
        return [f"{path}: as it was before the correction" for path in self.paths]

    def save(self, folder: str | Path) -> tuple[Path, ...]:
        """Write the originals into a folder, all or nothing.

        Returns:
            The files written.

        Raises:
            InputError: If a file would be overwritten that was read, or that truearm has not written.
        """
        folder = output_folder(folder)
        write_programs(folder, [file.path for file in self.files], {file.name: file.original for file in self.files})
        return tuple(folder / file.name for file in self.files)
