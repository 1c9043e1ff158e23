"""Studies with small settings, once for all tests of a process, and what is read from them."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import Any

from papers.study import Row, Study, Table
from truearm.engine.twin.devices import named_device

#: Seeds and settings by study; that of the measured robot needs data.
SETTINGS: dict[str, tuple[int, dict[str, Any]]] = {
    "hexapod-device": (2, {"trials": 2000, "places": False}),
    "irb120-axes": (1, {"coarser": 5}),
    "irb120-devices": (
        1,
        {
            "unseen": 12,
            "candidates": 100,
            "devices": [named_device(name) for name in ("tracker", "ballbar", "point")],
            "training": (30, 150),
            "zoned": ("geometric", "elastic"),
            "divisions": ((2, 1, 2),),
        },
    ),
    "irb120-hexapod": (1, {"unseen": 40, "coarser": 6}),
    "irb120-simulation": (1, {"unseen": 60}),
    "katana-devices": (1, {"registry": 16, "touched": 16, "drawn": 24, "unseen": 20}),
    "katana-influence": (2, {"count": 24, "unseen": 20}),
    "katana-tilting": (1, {"count": 40, "unseen": 60}),
    "katana-trajectory": (1, {"step": 0.3, "poses": 40}),
    "kr5-gdt": (2, {"repetitions": 40}),
    "li-table": (1, {"unseen": 60}),
    "lrmate-hexapod": (1, {"configurations": 300, "others": 120}),
}


@cache
def small(name: str) -> Study:
    seeds, settings = SETTINGS[name]
    study: Study = import_module(f"papers.{name.replace('-', '_')}").study(seeds, lambda _: None, **settings)
    return study


def table(found: Study, words: str) -> Table:
    """Return the table with these words in its title; one whose title is no more than they, if there are several."""
    tables = [table for table in found.tables if words in table.title]
    exact = [table for table in tables if table.title == words]
    (only,) = exact or tables
    return only


def row(found: Study, words: str, what: str) -> Row:
    (only,) = (row for row in table(found, words).rows if row.what == what)
    return only


def medians(found: Study, words: str) -> dict[str, float]:
    return {row.what: row.median for row in table(found, words).rows}
