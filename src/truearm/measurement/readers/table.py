"""Importer for any table: what its columns mean is said in a mapping file."""

from __future__ import annotations

from dataclasses import replace
from itertools import compress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError, nearest_names
from truearm.files import read_bytes, read_yaml
from truearm.limits import refuse_beyond
from truearm.measurement.dataset import Dataset, IntArray
from truearm.measurement.readers.cells import Cells, read_cells
from truearm.measurement.readers.mapping import (
    JointsEntry,
    LayoutEntry,
    MappingFile,
    NamesEntry,
    SigmaEntry,
    SigmaRotEntry,
    name_pattern,
)
from truearm.measurement.readers.rows import Configurations, Readings, dataset_of, found_configurations
from truearm.modeling.chain import Array
from truearm.modeling.controller import JointsOf
from truearm.shown import counted
from truearm.units import sized_si


def read_table(path: Path, mapping: Path, joints_are: JointsOf | None = None) -> Dataset:
    """Read any delimited text as its mapping file (schema ``truearm-mapping/1``) says.

    An empty cell is a missing reading; zeros are zeros. A second file with the joints is looked for beside
    the mapping. With ``key`` it also gives the order of the configurations, and one that was not measured
    stays, as missing readings.

    Parameters
    ----------
    joints_are
        Whose joint positions they are; None for what the mapping says.

    Raises
    ------
    InputError
        If a file cannot be used, or the mapping says that the joint positions are another's.
    """
    content = read_yaml(mapping, MappingFile)
    said = content.joints.are
    if joints_are is not None and said is not None and joints_are != said:
        raise InputError(
            "the mapping says whose joint positions they are",
            parameter="joints_are",
            where=f"{mapping}, joints.are",
            came=f"{joints_are}, and in the mapping {said}",
            cure="Leave one of them out.",
        )
    whose = joints_are or said or "model"
    cells = _read(path, content.layout)
    found: dict[str, list[str]] = {}
    if content.names is not None:
        cells, found = _split_names(cells, content.names, mapping)
    labels = found.get("configuration") or [str(number) for number in range(1, len(cells.lines) + 1)]
    if content.configuration is not None and content.configuration.column is not None:
        labels = list(cells.texts(_place(cells, content.configuration.column, mapping, "configuration.column")))
    configurations, of_row = _configurations(cells, labels, content.joints, whose, mapping)
    targets = _targets(cells, content, found.get("target"), mapping)
    entries = len(content.readings)
    position = np.stack(
        [
            _columns(cells, entry.position, content.length_unit, mapping, f"readings[{number}]")
            for number, entry in enumerate(content.readings, 1)
        ],
        axis=1,
    ).reshape(-1, 3)
    configuration = np.repeat(of_row, entries)
    lines = [line for line in cells.lines for _ in range(entries)]
    quaternion = _quaternions(cells, content, mapping)

    reference = _is_reference(targets, content.references, f"{mapping}, references")
    absent = np.setdiff1d(np.arange(len(configurations.labels)), of_row)
    kept = list(dict.fromkeys(compress(targets, ~reference)))
    added = len(absent) * len(kept)
    count = len(targets) + added

    def padded(values: Array) -> Array:
        return np.concatenate([values, np.full((added, values.shape[1]), np.nan)])

    readings = Readings(
        source=str(path),
        lines=lines + [0] * added,
        configuration=np.concatenate([configuration, np.repeat(absent, len(kept))]),
        targets=targets + kept * len(absent),
        reference=np.concatenate([reference, np.zeros(added, dtype=bool)]),
        position=padded(position),
        quaternion=None if quaternion is None else padded(quaternion),
        sigma=_everywhere(content.sigma, count, f"{mapping}, sigma.value"),
        sigma_rot=_everywhere(content.sigma_rot, count, f"{mapping}, sigma_rot.value"),
    )
    return dataset_of(readings, configurations)


def files_read(path: Path, mapping: Path) -> tuple[Path, ...]:
    """Return all files that :func:`read_table` reads."""
    joints = read_yaml(mapping, MappingFile).joints.file
    return (path, mapping) if joints is None else (path, mapping, mapping.parent / joints)


def _read(path: Path, entry: LayoutEntry) -> Cells:
    encoding = "utf-8-sig" if entry.encoding == "utf-8" else entry.encoding
    try:
        text = read_bytes(path).decode(encoding)
    except (UnicodeError, LookupError) as error:
        raise InputError(
            f"the file is not {entry.encoding} text",
            where=str(path),
            cure="Name its encoding in the mapping (layout.encoding), such as cp1252 or utf-16.",
        ) from error
    if not text.strip():
        raise InputError("the file is empty", where=str(path), cure="Check that it was exported whole.")
    return read_cells(text, str(path), entry.layout)


def _place(cells: Cells, column: str, mapping: Path, entry: str) -> int:
    """Return where a column is, or refuse a name that is not there or not unique."""
    count = cells.names.count(column)
    if count == 1:
        return cells.names.index(column)
    near = nearest_names(column, cells.names, 1) if cells.header is not None else []
    raise InputError(
        f"{cells.source} has {'no such column' if not count else f'{count} columns of this name'}",
        where=f"{mapping}, {entry}",
        came=column,
        allowed=", ".join(name for name in cells.names if name),
        cure=f"Did you mean {near[0]}?" if near and not count else "Check the header line and the delimiter.",
    )


def _columns(cells: Cells, columns: dict[str, str], unit: str, mapping: Path, entry: str) -> Array:
    places = [_place(cells, column, mapping, f"{entry}.{name}") for name, column in columns.items()]
    return np.column_stack([cells.numbers(place, unit, missing=True) for place in places])


def _split_names(cells: Cells, entry: NamesEntry, mapping: Path) -> tuple[Cells, dict[str, list[str]]]:
    """Return what the pattern finds in each name, and the rows without those to be skipped."""
    place = _place(cells, entry.column, mapping, "names.column")
    pattern = name_pattern(entry.pattern)
    texts = cells.texts(place)
    refuse_beyond("steps", pattern.programsize * sum(map(len, texts)), where=f"{mapping}, names.pattern")
    matches = [pattern.fullmatch(text) for text in texts]
    whole = [
        match is not None and all((found or "").strip() for found in match.groupdict().values()) for match in matches
    ]
    if not all(whole) and entry.others == "refuse":
        row = whole.index(False)
        raise InputError(
            "the name does not fit the pattern of the mapping",
            where=cells.place(row, place),
            came=texts[row],
            allowed=f"a name that is {entry.pattern} from end to end",
            cure="Correct the pattern (names.pattern), or write others: skip to leave such rows out.",
        )
    if not any(whole):
        raise InputError(
            "no name fits the pattern of the mapping",
            where=f"{mapping}, names.pattern",
            came=entry.pattern,
            allowed=f"a pattern for names such as {texts[0]!r}",
            cure="Correct the pattern.",
        )
    found = [match.groupdict() for match in compress(matches, whole) if match is not None]
    kept = replace(
        cells,
        lines=tuple(compress(cells.lines, whole)),
        columns=tuple(tuple(compress(column, whole)) for column in cells.columns),
    )
    return kept, {group: [names[group].strip() for names in found] for group in entry.groups}


def _configurations(
    cells: Cells, labels: list[str], entry: JointsEntry, joints_are: JointsOf, mapping: Path
) -> tuple[Configurations, IntArray]:
    """Return the configurations and which of them each row of the table belongs to."""
    if entry.file is None:
        table, row_labels = cells, labels
    else:
        table, row_labels = _read(mapping.parent / entry.file, entry.layout or LayoutEntry()), []
    places = [
        _place(table, column, mapping, f"joints.columns[{number}]") for number, column in enumerate(entry.columns, 1)
    ]
    if entry.key is not None:
        row_labels = list(table.texts(_place(table, entry.key, mapping, "joints.key")))
    elif entry.file is not None:
        row_labels = list(dict.fromkeys(labels))
        if len(row_labels) != len(table.lines):
            raise InputError(
                f"the file does not have as many rows as {cells.source} has configurations",
                where=table.source,
                came=counted(len(table.lines), "row"),
                allowed=counted(len(row_labels), "row"),
                cure="Without a key, row n is the nth configuration: name the column of labels.",
            )
    configurations = found_configurations(table, row_labels, places, entry.unit_of_each, joints_are)
    index = {label: number for number, label in enumerate(configurations.labels)}
    for row, label in enumerate(labels):
        if label not in index:
            near = nearest_names(label, index, 1)
            raise InputError(
                f"the configuration has no joints in {table.source}",
                where=f"{cells.source}, line {cells.lines[row]}",
                came=label,
                allowed=f"a label in column {entry.key}",
                cure=f"Did you mean {near[0]}?" if near else "Check joints.key, or add the row.",
            )
    return configurations, np.array([index[label] for label in labels], dtype=np.intp)


def _targets(cells: Cells, content: MappingFile, found: list[str] | None, mapping: Path) -> list[str]:
    """Return the target of each reading, row by row."""
    if found is not None:
        return found
    column = content.readings[0].target_column
    if column is not None:
        return list(cells.texts(_place(cells, column, mapping, "readings[1].target_column")))
    return [str(entry.target) for entry in content.readings] * len(cells.lines)


def _quaternions(cells: Cells, content: MappingFile, mapping: Path) -> Array | None:
    if not any(entry.quaternion for entry in content.readings):
        return None
    nothing = np.full((len(cells.lines), 4), np.nan)
    parts = [
        _columns(cells, entry.quaternion, "1", mapping, f"readings[{number}]") if entry.quaternion else nothing
        for number, entry in enumerate(content.readings, 1)
    ]
    return np.stack(parts, axis=1).reshape(-1, 4)


def _everywhere(sigma: SigmaEntry | SigmaRotEntry | None, count: int, where: str) -> Array | None:
    return None if sigma is None else np.full(count, sized_si(sigma.value, sigma.unit, where, deviation=True))


def _is_reference(targets: list[str], references: list[str], where: str) -> NDArray[np.bool_]:
    known = dict.fromkeys(targets)
    for name in references:
        if name not in known:
            near = nearest_names(name, known, 1)
            raise InputError(
                "there is no point of this name",
                where=where,
                came=name,
                allowed=", ".join(known),
                cure=f"Did you mean {near[0]}?" if near else "Name points that are in the table.",
            )
    return np.isin(np.array(targets), references)
