"""Importer for any table: what its columns mean is said in a mapping file."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from itertools import compress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError, Notice, counted, did_you_mean, nearest_names
from truearm.engine.base.files import exists, read_bytes, read_yaml, wide_encoding
from truearm.engine.base.limits import refuse_beyond
from truearm.engine.data.dataset import Dataset, IntArray
from truearm.engine.data.readers.cells import Cells, read_cells
from truearm.engine.data.readers.mapping import JointsEntry, LayoutEntry, MappingFile, NamesEntry, name_pattern
from truearm.engine.data.readers.measuring_order import measuring_order, refuse_returns
from truearm.engine.data.readers.presets import PRESETS, is_preset, mapping_path
from truearm.engine.data.readers.row_values import (
    called_in,
    deviations,
    numbers_of,
    place_of,
    quaternions,
    refuse_second_header,
    temperatures,
    uneven_deviations,
    unlikely_radians,
)
from truearm.engine.data.readers.rows import Configurations, Readings, dataset_of, row_configurations, visits_of
from truearm.engine.data.readers.sheets import is_workbook, joints_in_file, read_sheet
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import JointsOf


@dataclass(frozen=True)
class TableFiles:
    """The files of a table."""

    table: Path  #: The table itself.
    mapping: Path  #: Its mapping file, or the name of a preset.
    content: MappingFile  #: What the mapping says.
    joints: Path | None  #: The second file that holds the joints; None if the table holds them.

    @property
    def read(self) -> tuple[Path, ...]:
        """Return all files of a person's that are read."""
        mapping = () if is_preset(self.mapping) else (self.mapping,)
        return (self.table, *mapping, *(() if self.joints is None else (self.joints,)))

    @property
    def of_joints(self) -> JointsEntry:
        """Return what the mapping says of the joints, or refuse one that says nothing."""
        return _of_joints(self.content, self.mapping)


def read_mapping(mapping: Path) -> MappingFile:
    """Return what a mapping file, or a preset, says, or refuse one that nobody confirmed."""
    path = mapping_path(mapping)
    if not path.suffix and not exists(path):
        raise InputError(
            "there is no such file, and no such preset",
            parameter="mapping",
            came=str(mapping),
            allowed=f"a mapping file, or one of the presets {', '.join(PRESETS)}",
            cure=did_you_mean(str(mapping), PRESETS),
        )
    content = read_yaml(path, MappingFile)
    if not content.confirmed:
        raise InputError(
            "this mapping was guessed, and nobody has confirmed it",
            where=f"{path}, confirmed",
            came="no",
            allowed="yes",
            cure="Look at every line marked with a guess, correct it, and write confirmed: yes.",
        )
    return content


def _files(table: Path, mapping: Path, joints: Path | None) -> TableFiles:
    """Return the files of a table, or refuse a mapping that nobody confirmed."""
    path, content = mapping_path(mapping), read_mapping(mapping)
    named = _of_joints(content, path).file
    if joints is not None and named is None:
        raise InputError(
            "the mapping takes the joint positions from the table itself",
            parameter="joints_file",
            where=f"{path}, joints",
            came=str(joints),
            cure="Leave it out, or name a file under joints.file in the mapping.",
        )
    beside = table if is_preset(mapping) else path
    joints_file = joints if joints is not None or named is None else beside.parent / named
    return TableFiles(table, Path(mapping), content, joints_file)


def _of_joints(content: MappingFile, mapping: Path) -> JointsEntry:
    if content.joints is None:
        raise InputError(
            "this entry is missing",
            where=f"{mapping}, joints",
            allowed="joints: {columns: [..], unit: deg} of the table, or joints: {file: FILE.csv}",
            cure="Add it. Only `truearm measure` reads without: there the joint positions are those of the plan.",
        )
    return content.joints


def read_noting(
    path: Path, mapping: Path, joints_are: JointsOf | None = None, joints: Path | None = None
) -> tuple[Dataset, tuple[Notice, ...]]:
    """Read any delimited text, or a sheet of a workbook, as its mapping file (schema ``truearm-mapping/1``) says.

    An empty cell is a missing reading; zeros are zeros. A second file with the joints is looked for beside
    the mapping, or beside the table if the mapping is a preset. With ``key`` it also gives the order of the
    configurations, and one that was not measured stays, as missing readings.

    Args:
        mapping: The file, or the name of a preset.
        joints_are: Whose joint positions they are; None for what the mapping says.
        joints: The file of the joints; None for the one that the mapping names.

    Returns:
        The data, and what they cannot hold of the table.

    Raises:
        InputError: If a file cannot be used, or the mapping says that the joint positions are another's.
    """
    return read_with(_files(path, mapping, joints), joints_are)


def read_with(files: TableFiles, joints_are: JointsOf | None = None) -> tuple[Dataset, tuple[Notice, ...]]:
    """Read a table with its mapping, see :func:`read_noting`."""
    path, content, mapping = files.table, files.content, files.mapping
    whose = _whose(files.of_joints.are, joints_are, f"{mapping}, joints.are")
    cells, labels, groups = _named_rows(_read(path, content.layout, f"{mapping}, layout"), content, mapping)
    if labels is None:
        labels = [str(number) for number in range(1, len(cells.lines) + 1)]
    of_joints = _table_of_joints(cells, files)
    configurations, of_row = _configurations(cells, labels, of_joints, files, whose, joints_are)
    rows = _mapped(cells, labels, groups, content, mapping)
    targets, position, quaternion = list(rows.targets), rows.position, rows.quaternion
    sigma, sigma_rot = rows.sigma, rows.sigma_rot
    entries = len(content.readings)
    configuration = np.repeat(of_row, entries)
    lines = [line for line in cells.lines for _ in range(entries)]

    visit = None
    if content.visit is not None:
        visit = np.repeat(visits_of(cells, place_of(cells, content.visit.column, mapping, "visit.column")), entries)

    reference = _is_reference(targets, content.references, f"{mapping}, references")
    absent = np.setdiff1d(np.arange(len(configurations.labels)), of_row)
    measured = list(dict.fromkeys(compress(targets, ~reference)))
    added = len(absent) * len(measured)

    def padded(values: Array, *, same: bool = False) -> Array:
        """Return values with those of unmeasured configurations: none, or the `same` as everywhere."""
        return np.concatenate([values, np.full((added, *values.shape[1:]), values[0] if same else np.nan)])

    readings = Readings(
        source=cells.source,
        lines=lines + [0] * added,
        configuration=np.concatenate([configuration, np.repeat(absent, len(measured))]),
        targets=targets + measured * len(absent),
        reference=np.concatenate([reference, np.zeros(added, dtype=bool)]),
        position=padded(position),
        quaternion=None if quaternion is None else padded(quaternion),
        sigma=None if sigma is None else padded(sigma, same=content.sigma is not None),
        sigma_rot=None if sigma_rot is None else padded(sigma_rot, same=content.sigma_rot is not None),
        visit=None if visit is None else np.concatenate([visit, np.full(added, visit[0])]),
        called=called_in(content),
    )
    data = dataset_of(readings, configurations, _order(cells, configurations, of_row, files))
    data = replace(data, simulated=data.simulated or cells.simulated)
    noticed = (
        *uneven_deviations(cells, content, mapping),
        *unlikely_radians(cells, content, files.of_joints, of_joints, mapping),
    )
    if content.temperature is None:
        return data, noticed
    warm = temperatures(cells, configurations, of_row, content.temperature, mapping)
    return replace(data, temperature=warm), noticed


@dataclass(frozen=True, eq=False)
class MappedRows:
    """What the rows of a table hold, row by row; a row has as many readings as the mapping has entries of them."""

    cells: Cells  #: The rows, those to be skipped left out.
    #: Of each row's configuration, ``(rows,)``; None where every row is a configuration of its own.
    labels: tuple[str, ...] | None
    targets: tuple[str, ...]  #: Of each reading, ``(readings,)``.
    position: Array  #: [m], ``(readings, 3)``, NaN where nothing is.
    quaternion: Array | None  #: (w, x, y, z) as the table has it, ``(readings, 4)``; None if there is none.
    #: sigma, sigma_rot: standard deviations [m], [rad], ``(readings,)``; None if the table has none.
    sigma: Array | None
    sigma_rot: Array | None


def mapped_rows(cells: Cells, content: MappingFile, mapping: Path) -> MappedRows:
    """Return what the rows of a table hold, whatever configurations there are.

    Raises:
        InputError: If a column is missing, or a cell cannot be what its column holds.
    """
    named, labels, groups = _named_rows(cells, content, mapping)
    return _mapped(named, labels, groups, content, mapping)


def _named_rows(
    cells: Cells, content: MappingFile, mapping: Path
) -> tuple[Cells, list[str] | None, dict[str, list[str]]]:
    """Return the rows that are meant, their labels, None if they have none, and what the pattern finds in names."""
    cells, groups = replace(cells, absent=tuple(content.missing)), dict[str, list[str]]()
    if content.names is not None:
        cells, groups = _split_names(cells, content.names, mapping)
    refuse_second_header(cells, content)
    labels = groups.get("configuration")
    if content.configuration is not None and content.configuration.column is not None:
        labels = list(cells.texts(place_of(cells, content.configuration.column, mapping, "configuration.column")))
    return cells, labels, groups


def _mapped(
    cells: Cells, labels: list[str] | None, groups: dict[str, list[str]], content: MappingFile, mapping: Path
) -> MappedRows:
    targets = _targets(cells, content, groups.get("target"), mapping)
    position = np.stack(
        [
            numbers_of(cells, entry.position, content.length_unit, mapping, f"readings[{number}]")
            for number, entry in enumerate(content.readings, 1)
        ],
        axis=1,
    ).reshape(-1, 3)
    turned = quaternions(cells, content, mapping)
    sigma, sigma_rot = (deviations(cells, content, mapping, name) for name in ("sigma", "sigma_rot"))
    named = None if labels is None else tuple(labels)
    return MappedRows(cells, named, tuple(targets), position, turned, sigma, sigma_rot)


def files_read(path: Path, mapping: Path, joints: Path | None = None) -> tuple[Path, ...]:
    """Return all files that :func:`read_noting` reads."""
    return _files(path, mapping, joints).read


def _whose(stated: JointsOf | None, asked: JointsOf | None, where: str) -> JointsOf:
    """Return whose joint positions they are, or refuse two answers; `where` names what says it in a file."""
    if asked is not None and stated is not None and asked != stated:
        raise InputError(
            "the mapping says whose joint positions they are",
            parameter="joints_are",
            where=where,
            came=f"{asked}, and in the mapping {stated}",
            cure="Leave one of them out.",
        )
    return asked or stated or "model"


def _order(cells: Cells, configurations: Configurations, of_row: IntArray, files: TableFiles) -> IntArray | None:
    """Return the order of measurement that the mapping tells; None for what the labels tell."""
    entry = files.content.order
    if entry is None:
        return None
    places = [place_of(cells, column, files.mapping, f"order.{name}") for name, column in entry.names.items()]
    if entry.by == "rows" and files.joints is None:
        refuse_returns(cells, configurations.labels, of_row, f"{files.mapping}, order.by")
    return measuring_order(entry, cells, places, configurations.labels, of_row, f"{files.mapping}, order")


def _read(path: Path, entry: LayoutEntry, where: str) -> Cells:
    if is_workbook(path):
        if entry.of_text:
            raise InputError(
                "a workbook has cells, and no such thing",
                where=f"{where}.{entry.of_text[0]}",
                allowed="sheet, header and first_row",
                cure="Remove it.",
            )
        return read_sheet(path, entry.sheet, entry.layout, f"{where}.sheet")
    if entry.sheet is not None:
        raise InputError(
            "only workbooks have sheets",
            where=f"{where}.sheet",
            came=entry.sheet,
            cure=f"Remove it, or name a workbook instead of {path}.",
        )
    encoding = "utf-8-sig" if entry.encoding == "utf-8" else entry.encoding
    content = read_bytes(path)
    try:
        text = content.decode(encoding)
    except (UnicodeError, LookupError) as error:
        raise InputError(
            f"the file is not {entry.encoding} text",
            where=f"{path}{_place_of_byte(content, error, entry.layout.delimiter)}",
            cure="Name its encoding in the mapping (layout.encoding), such as cp1252 or utf-16.",
        ) from error
    if "\0" in text and (wide := wide_encoding(content)) is not None:
        raise InputError(
            f"the file is not {entry.encoding} text: its zero bytes are those of UTF-16",
            where=str(path),
            cure=f"Name its encoding in the mapping (layout.encoding): {wide}.",
        )
    if not text.strip():
        raise InputError("the file is empty", where=str(path), cure="Check that it was exported whole.")
    return read_cells(text, str(path), entry.layout)


def _place_of_byte(content: bytes, error: Exception, delimiter: str | None) -> str:
    """Return the line and the cell of a byte that is no text, where bytes are signs."""
    if not isinstance(error, UnicodeDecodeError) or error.encoding.startswith("utf-16"):
        return ""
    *above, before = content[: error.start].split(b"\n")
    cell = "" if delimiter is None else f", cell {before.count(delimiter.encode()) + 1}"
    return f", line {len(above) + 1}{cell}"


def _split_names(cells: Cells, entry: NamesEntry, mapping: Path) -> tuple[Cells, dict[str, list[str]]]:
    """Return what the pattern finds in each name, and the rows without those to be skipped."""
    place = place_of(cells, entry.column, mapping, "names.column")
    pattern = name_pattern(entry.pattern)
    texts = cells.texts(place)
    refuse_beyond("steps", pattern.programsize * sum(map(len, texts)), where=f"{mapping}, names.pattern")
    matches = [pattern.fullmatch(text) for text in texts]
    whole = [
        match is not None and all((text or "").strip() for text in match.groupdict().values()) for match in matches
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
    matched = [match.groupdict() for match in compress(matches, whole) if match is not None]
    remaining = replace(
        cells,
        lines=tuple(compress(cells.lines, whole)),
        columns=tuple(tuple(compress(column, whole)) for column in cells.columns),
    )
    return remaining, {group: [names[group].strip() for names in matched] for group in entry.groups}


def _configurations(
    cells: Cells,
    labels: list[str],
    of_joints: Cells | None,
    files: TableFiles,
    joints_are: JointsOf,
    asked: JointsOf | None,
) -> tuple[Configurations, IntArray]:
    """Return the configurations and which of them each row of the table belongs to."""
    entry, mapping = files.of_joints, files.mapping
    if files.joints is not None and of_joints is None:
        table, configurations = joints_in_file(files.joints)
        if asked is not None:
            _whose(configurations.joints_are, asked, table.source)
        return configurations, _of_rows(cells, labels, configurations, table, "configuration")
    table = cells if of_joints is None else of_joints
    row_labels = labels if files.joints is None else []
    places = [
        place_of(table, column, mapping, f"joints.columns[{number}]") for number, column in enumerate(entry.columns, 1)
    ]
    if entry.key is not None:
        row_labels = list(table.texts(place_of(table, entry.key, mapping, "joints.key")))
    elif files.joints is not None:
        row_labels = list(dict.fromkeys(labels))
        if len(row_labels) != len(table.lines):
            raise InputError(
                f"the file does not have as many rows as {cells.source} has configurations",
                where=table.source,
                came=counted(len(table.lines), "row"),
                allowed=counted(len(row_labels), "row"),
                cure="Without a key, row n is the nth configuration: name the column of labels.",
            )
    configurations = row_configurations(table, row_labels, places, entry.unit_of_each, joints_are)
    return configurations, _of_rows(cells, labels, configurations, table, entry.key)


def _table_of_joints(cells: Cells, files: TableFiles) -> Cells | None:
    """Return the table that has the columns of the joints; None if the mapping names none."""
    entry = files.of_joints
    if not entry.columns:
        return None
    if files.joints is None:
        return cells
    return _read(files.joints, entry.layout or LayoutEntry(), f"{files.mapping}, joints.layout")


def _of_rows(
    cells: Cells, labels: list[str], configurations: Configurations, table: Cells, key: str | None
) -> IntArray:
    """Return the configuration of each row; `key` is the column of `table` that has the labels."""
    index = {label: number for number, label in enumerate(configurations.labels)}
    for row, label in enumerate(labels):
        if label not in index:
            near = nearest_names(label, index, 1)
            number = re.search(r"[0-9]+$", label)
            if number and (alone := str(int(number[0]))) in index:
                cure = (
                    f"Did you mean {alone}? A pattern of the mapping reads the number alone: "
                    "names: {column: ..., pattern: '[^0-9]*0*(?P<configuration>[0-9]+)'}."
                )
            else:
                cure = f"Did you mean {near[0]}?" if near else "Check joints.key, or add the row."
            raise InputError(
                f"the configuration has no joints in {table.source}",
                where=f"{cells.source}, line {cells.lines[row]}",
                came=label,
                allowed=f"a label in column {key}",
                cure=cure,
            )
    return np.array([index[label] for label in labels], dtype=np.intp)


def _targets(cells: Cells, content: MappingFile, names: list[str] | None, mapping: Path) -> list[str]:
    """Return the target of each reading, row by row."""
    if names is not None:
        return names
    column = content.readings[0].target_column
    if column is not None:
        return list(cells.texts(place_of(cells, column, mapping, "readings[1].target_column")))
    return [str(entry.target) for entry in content.readings] * len(cells.lines)


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
