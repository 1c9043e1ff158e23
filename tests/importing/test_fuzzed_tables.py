"""Tables of many layouts with one odd cell each: what it stands in is read as before, or refused by its place."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import pytest
from tests.fuzz.mutations import ODD

from truearm.engine.base.errors import InputError
from truearm.engine.base.units import as_number
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.table import read_noting
from truearm.importing.guess import guess_mapping

#: How many tables; 2000 once in a while.
COUNT: Final = int(os.environ.get("TRUEARM_FUZZED_TABLES", "250"))
NAMES: Final = ("Point", "Q1", "Q2", "X", "Y", "Z", "Rx", "Ry", "Rz", "S", "T", "When")
SIGNS: Final = {"comma": ",", "semicolon": ";", "tab": "\t"}
MORE: Final = (
    "n/a",
    "-",
    "12,5",
    "1.234,5",
    "=A1",
    "#REF!",
    "1e400",
    "0.0.1",
    "1-2",
    "12:30",
    "O.5",
    "5mm",
    "½",
    "++1",
)
MAPPING: Final = """\
truearm: truearm-mapping/1
layout: {{delimiter: {delimiter}, decimal: {decimal}, header: {header}, comment: '//'}}
configuration: {{column: Point}}
length_unit: mm
missing: [n/a]
readings:
  - target: ball
    x: X
    y: Y
    z: Z
    angles: {{columns: [Rx, Ry, Rz], about: zyx, axes: moving, unit: deg}}
    sigma: {{columns: [S], unit: mm, coverage: 2}}
temperature: {{column: T, unit: degC}}
order: {{column: When}}
joints: {{columns: [Q1, Q2], unit: deg}}
"""


@dataclass(frozen=True)
class Table:
    """A table, and what it is with an odd cell."""

    sound: str
    odd: str
    mapping: str
    row: int
    column: int
    line: int
    text: str


def drawn(rng: np.random.Generator) -> Table:
    rows = int(rng.integers(2, 6))
    numbers = rng.uniform(-90, 90, (rows, 8)).round(3)
    cells = [
        [f"P{n + 1}", *map(str, numbers[n]), "0.02", str(20 + n), str(10 * n + int(rng.integers(9)))]
        for n in range(rows)
    ]
    delimiter = str(rng.choice(list(SIGNS)))
    decimal = "point" if delimiter == "comma" else str(rng.choice(["point", "comma"]))
    above = [["// remark"], ["Title of nothing"]][: int(rng.integers(3))]
    text = str(rng.choice([*ODD, *MORE]))
    row, column = int(rng.integers(rows)), int(rng.integers(len(NAMES)))

    def written(table: list[list[str]]) -> str:
        sign = SIGNS[delimiter]
        lines = [*(a[0] for a in above), sign.join(NAMES), *(sign.join(cells) for cells in table)]
        return "\n".join(lines) + "\n"

    def in_decimal(table: list[list[str]]) -> list[list[str]]:
        return [[c.replace(".", ",") for c in cells] for cells in table] if decimal == "comma" else table

    sound = in_decimal(cells)
    odd = [list(cells) for cells in sound]
    odd[row][column] = text
    mapping = MAPPING.format(delimiter=delimiter, decimal=decimal, header=len(above) + 1)
    return Table(written(sound), written(odd), mapping, row, column, len(above) + 2 + row, text)


def same_elsewhere(first: Dataset, second: Dataset, row: int) -> bool:
    elsewhere = np.arange(len(first.target)) != row
    return all(
        np.array_equal(a[elsewhere], b[elsewhere], equal_nan=True)
        for a, b in (
            (first.position, second.position),
            (first.joints, second.joints),
            (np.asarray(first.sigma), np.asarray(second.sigma)),
            (np.asarray(first.temperature), np.asarray(second.temperature)),
        )
    )


def finding(case: int, folder: Path) -> str:
    """Return what is wrong with how a table was read, nothing if all is well."""
    table = drawn(np.random.default_rng([18, case]))
    file, mapping = folder / "table.csv", folder / "map.yaml"
    mapping.write_text(table.mapping)
    file.write_text(table.sound)
    sound = read_noting(file, mapping)[0]
    file.write_bytes(table.odd.encode("utf-8", "surrogateescape"))
    structure = any(sign in table.text for sign in (*SIGNS.values(), '"', "\n", "\r", "//"))
    try:
        data = read_noting(file, mapping)[0]
    except InputError as error:
        place = f"line {table.line}"
        cell = f"{place}, column {NAMES[table.column]}"
        message = str(error)
        if structure:
            return "" if "line " in message or "quotes" in message else message
        overlaps = NAMES[table.column] == "When" and "column When" in message  # the other of two that coincide
        return "" if cell in message or overlaps else f"{table.text!r} in {cell}: {message}"
    if structure:
        return ""
    number = as_number(table.text.replace(",", ".") if "decimal: comma" in table.mapping else table.text)
    is_text = NAMES[table.column] == "Point"
    if number is None and not is_text and table.text.strip() not in ("", "n/a"):
        return f"{table.text!r} was read in {NAMES[table.column]}"
    return "" if same_elsewhere(sound, data, table.row) else f"{table.text!r} changed another row"


def test_odd_cells_are_refused_by_their_place(tmp_path: Path) -> None:
    findings = [f"{case}: {words}" for case in range(COUNT) if (words := finding(case, tmp_path))]
    assert not findings, "\n".join(findings[:20])


def test_a_guess_of_a_damaged_table_is_a_guess_or_a_refusal(tmp_path: Path) -> None:
    guessed = 0
    for case in range(COUNT // 4):
        table = drawn(np.random.default_rng([19, case]))
        (tmp_path / "table.csv").write_bytes(table.odd.encode("utf-8", "surrogateescape"))
        try:
            guessed += "confirmed: no" in guess_mapping(tmp_path / "table.csv").text
        except InputError:
            continue
    assert guessed > COUNT // 8


@pytest.mark.parametrize("place", ["D3", "G4", "K3", "L4", "B3"])
def test_odd_cells_of_a_workbook_are_refused_by_their_place(tmp_path: Path, place: str) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    mapping = "\n".join(line for line in MAPPING.splitlines() if not line.startswith("layout")).format()
    (tmp_path / "map.yaml").write_text(mapping + "\nlayout: {header: 2}\n")
    for text in ("x", "1,5", "#REF!", "--1", "5 mm"):
        book = openpyxl.Workbook()
        book.active.title = "Points"
        for row in ([], NAMES, ["P1", *range(1, 9), 0.02, 20, 1], ["P2", *range(2, 10), 0.02, 21, 2]):
            book.active.append(row)
        book.active[place] = text
        book.save(tmp_path / "table.xlsx")
        with pytest.raises(InputError, match=f"Points!{place}: "):
            read_noting(tmp_path / "table.xlsx", tmp_path / "map.yaml")
