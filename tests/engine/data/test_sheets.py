"""Sheets of Excel workbooks: what they hold cell by cell, and what is refused by its place in the sheet."""

from __future__ import annotations

import math
import sys
import zipfile
from collections.abc import Callable
from datetime import date, datetime, time
from pathlib import Path
from typing import Any

import pytest
from tests.expecting import refusing

from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.data.readers.cells import column_letters
from truearm.engine.data.readers.table import read_noting

openpyxl = pytest.importorskip("openpyxl")
NO_WORKBOOK = "cell.xlsx: this is no Excel workbook that can be read"

MAP = """
truearm: truearm-mapping/1
layout: {sheet: Cell 4, header: 2}
configuration: {column: Pose}
length_unit: mm
missing: ['#N/A', '-']
readings:
  - {target: ball, x: X, y: Y, z: Z}
order: {column: When, time: iso}
joints: {columns: [A1, A2], unit: deg}
"""
ROWS = [
    ["Campaign of March"],
    ["Pose", "A1", "A2", "X", "Y", "Z", "When"],
    ["P2", 10, 20.5, 1841.25, 112.5, 655, datetime(2026, 3, 1, 10, 0, 5)],
    [],
    ["P1", -35, 12, "#N/A", "-", None, datetime(2026, 3, 1, 9, 59, 0)],
]


def written(folder: Path, change: Callable[[Any], None] = lambda sheet: None, mapping: str = MAP) -> tuple[Path, Path]:
    book = openpyxl.Workbook()
    book.active.title = "Notes"
    sheet = book.create_sheet("Cell 4")
    for row in ROWS:
        sheet.append(row)
    change(sheet)
    book.save(folder / "cell.xlsx")
    (folder / "map.yaml").write_text(mapping)
    return folder / "cell.xlsx", folder / "map.yaml"


def read(folder: Path, change: Callable[[Any], None] = lambda sheet: None, mapping: str = MAP) -> Dataset:
    return read_noting(*written(folder, change, mapping))[0]


def put(place: str, value: object) -> Callable[[Any], None]:
    def change(sheet: Any) -> None:
        sheet[place] = value

    return change


def test_a_sheet_cell_by_cell(tmp_path: Path) -> None:
    data = read(tmp_path)
    assert csv_text(data) == (
        "configuration,order,joint_1 [deg],joint_2 [deg],target,x [mm],y [mm],z [mm]\n"
        "P2,2,10.0,20.5,ball,1841.25,112.5,655.0\n"
        "P1,1,-35.0,12.0,ball,,,\n"
    )
    assert data.source.endswith("cell.xlsx, sheet Cell 4")


def test_times_and_truths_are_texts(tmp_path: Path) -> None:
    def change(sheet: Any) -> None:
        sheet["A3"], sheet["A5"] = date(2026, 3, 1), True
        sheet["G3"], sheet["G5"] = time(10, 30), time(9, 5)

    data = read(tmp_path, change, MAP.replace("time: iso", "time: '%H:%M:%S'"))
    assert data.labels == ("2026-03-01 00:00:00", "TRUE")
    assert data.number is not None
    assert data.number.tolist() == [1, 0]


def test_joints_may_stand_in_a_workbook_too(tmp_path: Path) -> None:
    book = openpyxl.Workbook()
    for row in (["P", "q"], ["P1", 1.5], ["P2", 2]):
        book.active.append(row)
    book.save(tmp_path / "joints.xlsx")
    mapping = MAP.replace("{columns: [A1, A2], unit: deg}", "{file: joints.xlsx, key: P, columns: [q], unit: rad}")
    data = read(tmp_path, mapping=mapping)
    assert (data.labels, data.joints.tolist()) == (("P1", "P2"), [[1.5], [2.0]])


def test_refusals_name_the_cell(tmp_path: Path) -> None:
    wrong: list[tuple[Callable[[Any], None], str]] = [
        (put("D3", "=1840+1.25"), "cell.xlsx, 'Cell 4'!D3: the formula has no value in the file; got '=1840+1.25'"),
        (put("B2", "=1"), "'Cell 4'!B2: the formula has no value"),
        (put("D3", "x"), "'Cell 4'!D3: a number belongs here; got 'x'"),
        (put("B5", None), "'Cell 4'!B5: the cell is empty"),
        (put("I5", "note"), "'Cell 4'!I5: this cell has no name in the header; got 'note'"),
        (put("G5", "yesterday"), "'Cell 4'!G5: this is no time"),
        (lambda sheet: sheet.merge_cells("D2:F2"), "'Cell 4'!D2: these cells are merged; got 'D2:F2'"),
        (lambda sheet: sheet.merge_cells("A3:A5"), "'Cell 4'!A3: these cells are merged"),
        (lambda sheet: sheet.delete_rows(3, 5), "sheet Cell 4: the sheet holds no rows"),
        (lambda sheet: sheet.delete_cols(1, 9), "sheet Cell 4, line 2: the line that should"),
        (put("AAA99999", 1), "'Cell 4'!AAA99999: this cell has no name in the header; got '1'"),
    ]
    for change, part in wrong:
        with refusing(part, of=part):
            read(tmp_path, change)
    assert read(tmp_path, lambda sheet: sheet.insert_rows(3)).labels == ("P2", "P1")  # an empty row changes nothing
    for layout, part in (
        ("{header: 2}", f"map.yaml, layout.sheet: {tmp_path}/cell.xlsx has several sheets; allowed: Notes, Cell 4"),
        ("{sheet: cell 4, header: 2}", "has no such sheet; got 'cell 4'; allowed: Notes, Cell 4. Did you mean Cell 4?"),
        ("{sheet: Cell 4, decimal: comma}", "map.yaml, layout.decimal: a workbook has cells, and no such thing"),
        ("{sheet: Notes}", "sheet Notes, line 1: the line that should hold the header is empty"),
    ):
        with refusing(part, of=layout):
            read(tmp_path, mapping=MAP.replace("{sheet: Cell 4, header: 2}", layout))


def test_titles_may_be_merged_and_two_headings_are_refused(tmp_path: Path) -> None:
    assert read(tmp_path, lambda sheet: sheet.merge_cells("A1:G1")).configurations == 2

    def units(sheet: Any) -> None:
        sheet.insert_rows(3)
        for place, text in zip(("A3", "B3", "C3", "D3", "E3", "F3"), ("", "deg", "deg", "mm", "mm", "mm"), strict=True):
            sheet[place] = text

    with refusing("'Cell 4'!D3: this row holds no numbers, like a second line of headings"):
        read(tmp_path, units)
    assert read(tmp_path, units, MAP.replace("header: 2", "header: 2, first_row: 4")).configurations == 2


def test_what_is_no_workbook(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    table, mapping = written(tmp_path)
    for ending in (".xls", ".ods"):
        with refusing("workbooks of this kind are not read", "Save it as an Excel workbook"):
            read_noting(table.with_suffix(ending), mapping)
    (tmp_path / "text.csv").write_text("a,b\n")
    with refusing("only workbooks have sheets"):
        read_noting(tmp_path / "text.csv", mapping)
    whole = table.read_bytes()
    for damaged in (b"a,b\n1,2\n", whole[:2000], whole[:600] + bytes(200) + whole[800:]):
        table.write_bytes(damaged)
        with refusing(NO_WORKBOOK):
            read_noting(table, mapping)
    with zipfile.ZipFile(table, "w", zipfile.ZIP_DEFLATED) as parts:
        parts.writestr("xl/workbook.xml", " " * 20_000_001)
    with refusing("the workbook is too large; got '20000001 bytes unpacked'"):
        read_noting(table, mapping)
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    with pytest.raises(InputError, match=r"openpyxl, and it is not installed.*pip install .truearm\[excel\]"):
        read_noting(table, mapping)


def test_columns_have_letters_and_numbers_are_those_that_excel_holds(tmp_path: Path) -> None:
    assert [column_letters(n) for n in (0, 25, 26, 701, 702)] == ["A", "Z", "AA", "ZZ", "AAA"]
    data = read(tmp_path, put("D3", 0.1 + 0.2))
    assert math.isclose(data.position[0, 0], 0.30000000000000004e-3, rel_tol=1e-15)


def changed(path: Path, old: str, new: str) -> None:
    """Change the text of the second sheet of a workbook."""
    with zipfile.ZipFile(path) as parts:
        held = {name: parts.read(name) for name in parts.namelist()}
    name = "xl/worksheets/sheet2.xml"
    assert old.encode() in held[name]
    held[name] = held[name].replace(old.encode(), new.encode(), 1)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as parts:
        for part, data in held.items():
            parts.writestr(part, data)


def test_sheets_that_no_spreadsheet_writes(tmp_path: Path) -> None:
    merged = '</sheetData><mergeCells><mergeCell ref="{}"/></mergeCells>'
    for old, new, part in (
        ('<row r="5"', '<row r="2"', NO_WORKBOOK),
        ('r="B5"', 'r="A5"', NO_WORKBOOK),
        ('<row r="5"', '<row r="3e12"', NO_WORKBOOK),
        ('<row r="5"', '<row r="900000000"', "the table has too many lines"),
        ("</sheetData>", merged.format("A3:XFD1048576"), "!A3: these cells are"),
        # what does not matter: a wrong size, a merged title however wide
        ('ref="A1:G5"', 'ref="A1:B3"', ""),
        ("</sheetData>", merged.format("A1:XFD1"), ""),
    ):
        table, mapping = written(tmp_path)
        changed(table, old, new)
        if not part:
            assert read_noting(table, mapping)[0].configurations == 2, new
            continue
        with refusing(part, of=new):
            read_noting(table, mapping)
