"""The jobs that import files of other programs."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.house.examples import EXAMPLES

import truearm
from truearm.engine.base.errors import InputError


def test_matrices_and_what_is_missing(tmp_path: Path) -> None:
    arguments = EXAMPLES["import_matrices"](tmp_path)
    read = truearm.import_matrices(**arguments, out=tmp_path / "data.csv")
    assert read.lines() == [
        f"2 configurations, targets 1: {tmp_path / 'data.csv'}",
        "  1: 1 missing reading",
        "  base: 1 missing reading",
    ]
    assert truearm.load_data(tmp_path / "data.csv").configurations == 2
    with pytest.raises(InputError, match="would be overwritten") as refusal:
        truearm.import_matrices(**arguments, out=arguments["joints_file"])
    assert refusal.value.parameter == "out"


def test_a_table_is_not_written_over_its_mapping(tmp_path: Path) -> None:
    arguments = EXAMPLES["import_table"](tmp_path)
    assert truearm.import_table(**arguments).lines() == ["2 configurations, targets tip"]
    with pytest.raises(InputError, match="would be overwritten"):
        truearm.import_table(**arguments, out=arguments["mapping"])


def test_circles_need_a_scan_and_a_table_each(tmp_path: Path) -> None:
    arguments = EXAMPLES["import_circle"](tmp_path)
    read = truearm.import_circle(**arguments)
    assert read.lines() == ["2 configurations on 1 page"]
    assert read.data.sigma is not None
    for name, words in (("points", "got 'nothing for a'"), ("scans", "no page is given")):
        with pytest.raises(InputError, match=words) as refusal:
            truearm.import_circle(**{**arguments, name: {}})
        assert refusal.value.parameter == name
    for dpi in (0.0, [300.0, 5.0]):
        with pytest.raises(InputError, match="this is no resolution of a scan") as refusal:
            truearm.import_circle(**{**arguments, "dpi": dpi})
        assert refusal.value.parameter == "dpi"
