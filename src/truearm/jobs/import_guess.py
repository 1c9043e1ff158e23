"""The mapping file that a table seems to need."""

from __future__ import annotations

from pathlib import Path

from truearm.errors import refusals_of
from truearm.files import path_argument
from truearm.jobs.arguments import file_for
from truearm.measurement.readers.guessing.guess import guess_mapping
from truearm.results.guessed_mapping import GuessedMapping
from truearm.writing import new_file, write_text


def import_guess(file: str | Path, *, out: str | Path | None = None) -> GuessedMapping:
    """Look at a table and write the mapping file that it seems to need; nothing is imported.

    Every guess is marked, and `import_table` refuses the mapping until somebody has written ``confirmed: yes`` into it.

    Parameters
    ----------
    file
        A CSV, another delimited text, or an Excel workbook.
    out
        Mapping file to write, which must not exist yet; None writes nothing.

    Raises
    ------
    InputError
        If the file does not look like a table of measurements.
    """
    table = path_argument(file, "file")
    target = None if out is None else new_file(file_for(out, table))
    with refusals_of("file"):
        guessed = guess_mapping(table)
    if target is not None:
        write_text(target, guessed.text)
    return GuessedMapping(guessed, target)
