"""A study's words and the numbers that its document prints, read from its ``study.yaml``, beside our figures.

The file has ``title``, ``source`` and ``answer``, ``tables``, ``pictures`` and ``notes``. A table has a title and
words; ``unit``, ``source`` and ``claim`` hold for all its rows, and ``sources`` and ``claims`` for single ones;
``printed`` has the printed numbers by row, with all their digits, and ``why`` explains rows. In these four a mapping
within the mapping goes on where the name before it ends: ``"T1, ": {mean: 0.283}`` is of the row "T1, mean". A unit
before the tables is that of every table without one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np

from papers.study import Picture, Row, Study, Table
from papers.verdicts import Claim
from truearm.engine.document.drawing import Figure

#: Ours by row: what it is of, with its unit in brackets if it is not that of its table. One value a seed, or a number
#: that no chance enters; a row without any value is left out.
Rows = Mapping[str, Sequence[float] | float]
#: What is said of rows beyond the file, by table and row.
Said = Mapping[str, Mapping[str, str]]


def told(
    folder: str | Path,
    seeds: int,
    tables: Mapping[str, Rows],
    figures: Mapping[str, Figure],
    texts: Mapping[str, object] | None = None,
    *,
    printed: Said | None = None,
    why: Said | None = None,
    files: Mapping[str, str] | None = None,
) -> Study:
    """Return a study: the words of ``study.yaml``, and our figures beside those printed there.

    A text of the file may name a value in braces, with its format: one of `texts`, ``seeds``, or ``table[row]``, the
    median of that row.

    Args:
        folder: Of the study, or a module in it.
        seeds: How many.
        tables: Our figures by table and row, in the order of the rows.
        figures: What is drawn, by the name of the picture.
        texts: What texts name.
        printed: Printed numbers that follow from others of the document.
        why: Explanations that follow from what was found.
        files: What else the study writes.

    Raises:
        KeyError: If the file speaks of a row, a table or a value that there is not.
    """
    name = Path(folder).parent.name
    written = _written(Path(folder).with_name("study.yaml"))
    medians = {
        key: {row.partition(" [")[0]: np.median(of) for row, of in rows.items() if np.size(of)}
        for key, rows in tables.items()
    }

    def filled(text: str) -> str:
        return text.format_map({"seeds": seeds, **medians, **(texts or {})})

    def table(key: str, of: Mapping[str, Any]) -> Table:
        of = {"unit": written.get("unit", ""), **of}
        rows = _rows(of, tables[key], (printed or {}).get(key, {}), (why or {}).get(key, {}), filled)
        return Table(filled(of["title"]), filled(of["words"]), tuple(rows))

    return Study(
        name=name.replace("_", "-"),
        title=written["title"],
        source=written["source"],
        answer=filled(written["answer"]),
        seeds=seeds,
        tables=tuple(table(key, of) for key, of in written["tables"].items() if tables.get(key)),
        pictures=tuple(
            Picture(key, filled(of["title"]), filled(of["words"]), figures[key])
            for key, of in written["pictures"].items()
        ),
        notes=tuple(map(filled, written["notes"])),
        files=files or {},
    )


def printed_in(module: str | Path, table: str) -> dict[str, str]:
    """Return the printed numbers of a table by row, from the ``study.yaml`` beside a module."""
    return _flat(_written(Path(module).with_name("study.yaml"))["tables"][table]["printed"])


def _written(file: Path) -> dict[str, Any]:
    """Read a file, all scalars as text: a printed 0.50 keeps its digits."""
    from ruamel.yaml import YAML

    return cast("dict[str, Any]", YAML(typ="base").load(file))


def _flat(entries: Mapping[str, Any], name: str = "") -> dict[str, str]:
    """Return entries by their whole names: a mapping among them goes on where its own name ends."""
    found: dict[str, str] = {}
    for key, entry in entries.items():
        found |= {name + key: entry} if isinstance(entry, str) else _flat(entry, name + key)
    return found


def _rows(
    of: Mapping[str, Any], ours: Rows, printed: Mapping[str, str], why: Mapping[str, str], filled: Any
) -> Iterator[Row]:
    """Give the rows of a table, as the file and what was found tell of them."""
    printed, why = {**_flat(of.get("printed", {})), **printed}, {**_flat(of.get("why", {})), **why}
    sources, claims = _flat(of.get("sources", {})), _flat(of.get("claims", {}))
    printed, why, sources, claims = (
        {filled(row): said[row] for row in said} for said in (printed, why, sources, claims)
    )
    left = {*printed, *why, *sources, *claims}
    for key, values in ours.items():
        what, bracket, unit = key.partition(" [")
        left.discard(what)
        if isinstance(values, float | int) or len(values):
            yield Row(
                what,
                unit.removesuffix("]") if bracket else of["unit"],
                values,
                printed.get(what),
                sources.get(what, of.get("source", "")) if what in printed else "",
                cast("Claim", claims.get(what, of.get("claim", "equal"))),
                filled(why.get(what, "")),
            )
    if left:
        raise KeyError(f"{of['title']}: there is no row {', '.join(sorted(left))}")
