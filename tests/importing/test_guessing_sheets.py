"""The sheet of a workbook that a guess is made from, and those that cannot be read."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

import truearm
from truearm.engine.base.errors import InputError
from truearm.importing.guess import guess_mapping


def filled(sheet: Any, rows: int) -> Any:
    """Return a sheet with headings and rows of a table."""
    sheet.append(["Pos", "A1", "A2", "X", "Y", "Z"])
    for n in range(1, rows + 1):
        sheet.append([n, 10 + 7 * n, 20 - 3.5 * n, 800 + n, 200 - n, 300 + n])
    return sheet


def book_of(rows: int, other: int | None = None) -> tuple[Any, Any]:
    """Return a workbook with a table of so many rows, below a sheet of words or of another table, and its sheet."""
    book = pytest.importorskip("openpyxl").Workbook()
    if other is None:
        book.active.append(["Campaign", 2026])
    else:
        filled(book.active, other)
    return book, filled(book.create_sheet("Data"), rows)


def test_merged_cells_among_data_are_refused_whatever_other_sheets_there_are(tmp_path: Path) -> None:
    book, sheet = book_of(10)
    sheet.merge_cells("A5:A6")
    book.save(tmp_path / "cell.xlsx")
    with pytest.raises(InputError, match=re.escape("Data!A5: these cells are merged; got 'A5:A6'")):
        guess_mapping(tmp_path / "cell.xlsx")


def test_a_formula_without_a_value_is_refused_whatever_other_sheets_there_are(tmp_path: Path) -> None:
    book, sheet = book_of(18)
    sheet["D9"] = "=1000*0.1"
    book.save(tmp_path / "cell.xlsx")
    with pytest.raises(InputError, match=re.escape("Data!D9: the formula has no value in the file")):
        guess_mapping(tmp_path / "cell.xlsx")


def test_a_larger_sheet_that_cannot_be_read_is_not_passed_over(tmp_path: Path) -> None:
    book, sheet = book_of(19, other=4)
    sheet.merge_cells("A5:A6")
    book.save(tmp_path / "cell.xlsx")
    with pytest.raises(InputError, match="these cells are merged"):
        guess_mapping(tmp_path / "cell.xlsx")


def test_a_smaller_sheet_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    book, sheet = book_of(3, other=12)
    sheet.merge_cells("A3:A4")
    book.save(tmp_path / "cell.xlsx")
    text = truearm.import_guess(tmp_path / "cell.xlsx").text
    assert "sheet: Sheet  # guess: it has the most numbers of 2 sheets that can be read" in text
    assert "# Note: the sheet Data was not read: " in text
    assert "these cells are merged" in text


def test_numbers_that_are_texts_are_refused(tmp_path: Path) -> None:
    book = pytest.importorskip("openpyxl").Workbook()
    book.active.append(["Pos", "A1", "X", "Y", "Z"])
    for n in range(1, 5):
        book.active.append([n, f"{n},5", f"80{n},1", "2,5", "3,5"])
    book.save(tmp_path / "cell.xlsx")
    with pytest.raises(InputError, match=r"no sheet looks like a table of numbers; .*as texts"):
        guess_mapping(tmp_path / "cell.xlsx")
