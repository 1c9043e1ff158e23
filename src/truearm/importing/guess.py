"""The mapping file that a table seems to need, with every guess marked and nothing confirmed."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Final

from ruamel.yaml import YAML

from truearm.engine.base.errors import InputError, counted, listed, refusals_of
from truearm.engine.base.files import path_argument
from truearm.engine.base.schemas import validated
from truearm.engine.base.writing import new_file, write_text
from truearm.engine.command.arguments import file_for
from truearm.engine.data.readers.mapping import MappingFile
from truearm.engine.data.readers.table import TableFiles, read_with
from truearm.engine.document.document import Block, say
from truearm.engine.document.records import Record
from truearm.engine.robot.urdf_writing import JOINT_COLUMN
from truearm.importing.layouts import GuessedLayout, guess_layout, number_of
from truearm.importing.meanings import (
    OPEN,
    Column,
    Guess,
    GuessedTime,
    MappingText,
    Triple,
    angle_unit,
    angles_among,
    columns_of,
    deviations_among,
    escaped,
    is_expanded,
    joints_among,
    length_unit,
    list_of,
    named,
    named_like,
    plain,
    positions_among,
    quaternion_among,
    quoted,
    stand_ins_among,
    time_among,
    unit_of,
)

if TYPE_CHECKING:
    from truearm.importing.jobs import GuessMapping

_NUMBERED: Final = re.compile("(.*?)[0-9]{1,9}")


@dataclass(frozen=True)
class Guessed:
    """A mapping that was guessed.

    Attributes:
        rows, configurations: How many rows and configurations such an import would read; 0 if it was not tried.
    """

    text: str  #: The mapping file.
    guesses: tuple[Guess, ...]  #: Every entry with what it rests on.
    #: Why an import with it would be refused as it stands; None if it would not, or if something is open.
    refusal: str | None = None
    configurations: int = 0
    targets: tuple[str, ...] = ()

    @property
    def open(self) -> tuple[str, ...]:
        """Return the entries that nothing in the file tells."""
        return tuple(guess.entry for guess in self.guesses if guess.value == OPEN or f"'{OPEN}'" in guess.value)


def guess_mapping(path: Path) -> Guessed:
    """Return the mapping file that a table seems to need.

    Raises:
        InputError: If it does not look like a table.
    """
    layout = guess_layout(path)
    columns = columns_of(layout)
    _refuse_canonical(path, layout)
    if layout.entries.get("delimiter", ("",))[0] == "whitespace":
        _refuse_cut_names(path, columns)
    text = MappingText()
    text.lines += [
        f"# Guessed from {escaped(path.name)}.",
        f"# Look at every line with a guess: correct it, answer each {OPEN}, and then write confirmed: yes.",
        "truearm: truearm-mapping/1",
        "confirmed: no",
    ]
    _write_layout(text, layout)
    left = _Left(list(columns))
    joints = left.take(joints_among(columns))
    quaternion, sure = quaternion_among(left.columns)
    left.take(quaternion)
    positions = positions_among([column for column in left.columns if column.is_numeric])
    if not positions:
        _refuse_other_numbers(path, positions_among(left.columns))
    if not positions and not layout.header:
        positions, joints = _by_place(left.columns, joints)
    for three in positions.values():
        left.take(three)
    left.take(joints)
    if not positions:
        raise InputError(
            "no columns look like x, y and z of a measured point",
            where=str(path),
            came=", ".join(column.name for column in columns if column.name)[:200] or None,
            allowed="three columns of numbers named x, y, z, such as X, Pos Y [mm] or ball_1_z",
            cure="Rename them, or write the mapping by hand: the guide has complete ones.",
        )
    others = [column for column in (*quaternion, *left.columns) if column.is_numeric and not column.counts]
    _write_missing(text, [*joints, *quaternion], list(positions.values()), others)
    _write_labels(text, left, joints, positions, quaternion, sure)
    _write_joints(text, joints)
    used = {column.place for column in columns} - {column.place for column in left.columns}
    odd = _no_numbers([column for column in columns if column.place in used and column.is_numeric], layout.lines)
    text.lines += [f"# Note: {escaped(note)}." for note in (*layout.notes, *odd)]
    if layout.header and any({"tcp", "x"} <= set(column.words) for column in left.columns):
        text.lines.append("# Note: tables of RoboDK with tool points come in by truearm import robodk.")
    unused = [column.name for column in left.columns if column.name]
    if unused:
        shown = ", ".join(escaped(name) for name in unused[:20])
        text.lines.append(f"# Not used: {shown}")
    guessed = Guessed("\n".join(text.lines) + "\n", tuple(text.guesses))
    return guessed if guessed.open or not joints else _tried(guessed, path)


def _no_numbers(columns: Sequence[Column], lines: Sequence[int]) -> list[str]:
    """Return where columns of numbers hold something else for the first time."""
    messages = []
    for column in columns:
        if len(column.values) + sum(text in column.nothing for text in column.filled) == len(column.filled):
            continue
        row, text = next(
            (row, text)
            for row, text in enumerate(column.texts)
            if text and text not in column.nothing and number_of(text, column.decimal) is None
        )
        messages.append(f"line {lines[row]}, column {column.name}: {text[:40]!r} is no number as others are written")
    return messages


def _refuse_other_numbers(path: Path, positions: Mapping[tuple[str, ...], Sequence[Column]]) -> None:
    """Refuse columns that are called like coordinates and hold no numbers as they are written in the file."""
    for three in positions.values():
        column = next(column for column in three if not column.is_numeric)
        raise InputError(
            f"the column {column.name} is called like a coordinate, and holds no numbers that can be read",
            where=str(path),
            came=next(iter(column.filled), None),
            allowed="numbers with one decimal sign and no thousands separators",
            cure="Export the table again without thousands separators.",
        )


def _refuse_canonical(path: Path, layout: GuessedLayout) -> None:
    """Refuse a table that is what an import would write."""
    names = [name.partition(" [")[0] for name in layout.names]
    if {"configuration", "target"} <= set(names) and any(JOINT_COLUMN.fullmatch(name) for name in names):
        raise InputError(
            "the columns are those of the canonical CSV, which needs no import",
            where=str(path),
            cure="Use it as it is: truearm check says what is left to fix.",
        )


def _refuse_cut_names(path: Path, columns: Sequence[Column]) -> None:
    """Refuse names with blanks in a table between whose columns are blanks."""
    for first, second in pairwise(columns):
        for text, other in zip(first.texts, second.texts, strict=True):
            if "::" in text and ("::" in other or all(text.isdigit() for text in second.texts)):
                raise InputError(
                    "a name with blanks seems to stand in a table whose columns are separated by blanks",
                    where=str(path),
                    came=f"{text} {other}",
                    cure="Export the table again with commas, semicolons or tabs between its columns.",
                )


class _Left:
    """The columns that mean nothing yet."""

    def __init__(self, columns: list[Column]) -> None:
        self.columns = columns

    def take(self, taken: Sequence[Column]) -> list[Column]:
        places = {column.place for column in taken}
        self.columns = [column for column in self.columns if column.place not in places]
        return list(taken)


def _write_layout(text: MappingText, layout: GuessedLayout) -> None:
    text.lines.append("layout:")
    for name, (value, because) in layout.entries.items():
        shown = str(value) if isinstance(value, int) else plain(value)
        text.add(f"layout.{name}", shown, because, f"  {name}: {shown}")


def _by_place(
    columns: Sequence[Column], joints: Sequence[Column]
) -> tuple[dict[tuple[str, ...], tuple[Column, Column, Column]], list[Column]]:
    """Return the last three columns of numbers as a position, and those before as joints, where nothing has a name."""
    numeric = [column for column in columns if column.is_numeric]
    if numeric and numeric[0].counts:
        del numeric[0]
    if len(numeric) < 3 or len(numeric) > 13:
        return {}, list(joints)
    first, second, third = numeric[-3:]
    return {(): (first, second, third)}, numeric[:-3]


def _write_missing(
    text: MappingText, columns: Sequence[Column], positions: Sequence[Triple], others: Sequence[Column]
) -> None:
    """Write texts that mean no reading; `others` are further columns in which they would mean so."""
    coordinates = [column for three in positions for column in three]
    texts = list(dict.fromkeys(odd for column in (*columns, *coordinates) for odd in column.nothing))
    because = "these texts stand among numbers" if texts else ""
    stand_ins, elsewhere = stand_ins_among(positions, others)
    if elsewhere:
        because = f"rows of {elsewhere} in all of x, y and z seem to be no readings, and {elsewhere} stands elsewhere "
        text.add("missing", quoted(OPEN), because + "too: empty the cells of those rows, and remove this line")
        return
    if stand_ins:
        because += "; " if because else ""
        because += f"rows have {', '.join(stand_ins)} in all of x, y and z"
    if because:
        shown = f"[{', '.join(plain(odd) for odd in (*texts, *stand_ins))}]"
        text.add("missing", shown, because)


def _write_labels(
    text: MappingText,
    left: _Left,
    joints: Sequence[Column],
    positions: dict[tuple[str, ...], tuple[Column, Column, Column]],
    quaternion: Sequence[Column],
    sure: bool,
) -> None:
    """Write where labels and targets are, then the columns of the readings and what belongs to them."""
    several = len(positions) > 1
    unclear = left.columns if several else []
    angles = None if quaternion else angles_among(left.columns)
    if angles is not None:
        left.take(angles[0])
    sigma = left.take(deviations_among(left.columns, ("x", "y", "z")))
    turned = bool(quaternion) or angles is not None
    sigma_rot = left.take(deviations_among(left.columns, ("rx", "ry", "rz"))) if turned else []
    if angles is not None and not sigma_rot:  # sA, sB, sC beside A, B, C
        sigma_rot = left.take(deviations_among(left.columns, [(column.words or ("",))[-1] for column in angles[0]]))
    unclear = [*quaternion, *(column for column in unclear if column not in left.columns)] if several else []
    temperature = named_like([c for c in left.columns if c.is_numeric], "temperature")
    left.take([temperature] if temperature else [])
    time = time_among(left.columns)
    left.take([] if time is None else time.columns)
    label, target, pattern = _names(left, several)
    _write_label(text, label, target, pattern, several=several)
    every = [column for three in positions.values() for column in three]
    if (visit := None if label is None else _visit(left, label, target)) is not None:
        text.add("visit", f"{{column: {named(visit)}}}", "its name; labels come again with another number")
    text.add("length_unit", *length_unit(every))
    text.lines.append("readings:")
    names_target = pattern is not None and "target" in pattern
    for key, three in positions.items():
        if several or (target is None and not names_target):
            name = " ".join(key) if several and key else "tip"
            because = "a name for it"
            if several and not key:
                because += "; remove this entry if it is what the controller shows"
            text.add("readings.target", plain(name), because, f"  - target: {plain(name)}")
            start = "    "
        elif target is not None:
            text.add(
                "readings.target_column", named(target), "its name or its texts", f"  - target_column: {named(target)}"
            )
            start = "    "
        else:
            start = "  - "
        for axis, column in zip("xyz", three, strict=True):
            text.add(
                f"readings.{axis}",
                named(column),
                "its name" if column.words else "its place",
                f"{start}{axis}: {named(column)}",
            )
            start = "    "
        if several:
            continue
        _write_orientation(text, quaternion, sure, angles)
        for name, columns_of_sigma, unit in (
            ("sigma", sigma, unit_of(sigma) or length_unit(every)[0]),
            ("sigma_rot", sigma_rot, unit_of(sigma_rot) or angle_unit(angles[0] if angles else ())[0]),
        ):
            if columns_of_sigma:
                coverage = ", coverage: 2" if is_expanded(columns_of_sigma) else ""
                value = f"{{columns: {list_of(columns_of_sigma)}, unit: {quoted(unit)}{coverage}}}"
                because = "their names; standard deviations, or expanded uncertainties by a coverage of 2"
                text.add(f"readings.{name}", value, because, f"    {name}: {value}")
    if several and (quaternion or angles or sigma):
        text.lines.append(
            "# Note: columns of orientations or deviations are there too; which target they are of is not clear."
        )
        left.columns = sorted([*left.columns, *unclear], key=lambda column: column.place)
    if temperature is not None:
        unit = temperature.unit if temperature.unit in ("degC", "degF", "K") else OPEN
        value = f"{{column: {named(temperature)}, unit: {quoted(unit)}}}"
        text.add("temperature", value, "its name")
    _write_order(text, label, time, pattern)


def _write_label(
    text: MappingText, label: Column | None, target: Column | None, pattern: str | None, *, several: bool
) -> None:
    if pattern is not None and label is not None:
        text.add(
            "names", "", "the names have parts between ::", f"names: {{column: {named(label)}, pattern: '{pattern}'}}"
        )
    elif label is not None:
        because = "its name or its texts"
        if label.is_numeric:
            because += "; whole numbers tell the order of measurement"
        if target is None and not several and label.distinct < len(label.texts):
            because += "; rows with the same label count as repeated readings of one target"
        text.add("configuration", "", because, f"configuration: {{column: {named(label)}}}")
    else:
        text.add(
            "configuration",
            "",
            "no column looks like a label; rows then count as measured in their order",
            "configuration: {each: row}",
        )


def _write_orientation(
    text: MappingText, quaternion: Sequence[Column], sure: bool, angles: tuple[Sequence[Column], str, str, str] | None
) -> None:
    if quaternion:
        because = "their names" if sure else "the sum of their squares is 1; whether w is first is not said"
        for name, column in zip(("qw", "qx", "qy", "qz"), quaternion, strict=True):
            text.add(f"readings.{name}", named(column), because, f"    {name}: {named(column)}")
    if angles is not None:
        three, about, axes, who = angles
        unit, why = angle_unit(three)
        value = f"{{columns: {list_of(three)}, about: {quoted(about)}, axes: {quoted(axes)}, unit: {quoted(unit)}}}"
        text.add(
            "readings.angles",
            value,
            f"{who}; {why}; a rotation vector is rotation_vector: {{columns, unit}}",
            f"    angles: {value}",
        )


def _names(left: _Left, several: bool) -> tuple[Column | None, Column | None, str | None]:
    """Return the columns of the configuration and of the target, and a pattern if one column holds both."""
    for column in left.columns:
        parts = {text.count("::") for text in column.texts}
        pattern = f"{'[^:]*::' if parts == {2} else ''}(?P<configuration>[^:]+)::(?P<target>[^:]+)"
        if parts in ({1}, {2}) and all(re.fullmatch(pattern, text) for text in column.texts):
            left.take([column])
            return column, None, pattern
    whole = [column for column in left.columns if column.filled and len(column.filled) == len(column.texts)]
    texts = [column for column in whole if column.can_name]
    target = None if several else named_like(texts, "target")
    left.take([target] if target else [])
    other_texts = [column for column in texts if column is not target]
    words = [column for column in other_texts if not column.is_numeric]
    label = named_like(words, "label") or named_like(other_texts, "label") or next(iter(words), None)
    label = label or next((column for column in other_texts if column.counts), None)
    left.take([label] if label else [])
    if label is not None and target is None and not several and label.distinct < len(label.texts):
        others = [column for column in words if column is not label]
        target = next((c for c in others if len(set(zip(label.texts, c.texts, strict=True))) == len(c.texts)), None)
        left.take([target] if target else [])
        if target is not None and target.distinct > label.distinct:
            label, target = target, label
    return label, target, None


def _visit(left: _Left, label: Column, target: Column | None) -> Column | None:
    """Return the column that tells apart rows of one label and one target, if one is called like that."""
    named_so = named_like([column for column in left.columns if column.is_numeric and column.can_name], "visit")
    if named_so is None or len(named_so.filled) < len(named_so.texts):
        return None
    reading = list(zip(label.texts, label.texts if target is None else target.texts, strict=True))
    if label.distinct == len(label.texts) or named_so.distinct < 2:
        return None
    apart = len(set(zip(reading, named_so.texts, strict=True))) - len(set(reading))
    if not apart and target is None:
        return None
    left.take([named_so])
    return named_so


def _write_joints(text: MappingText, joints: Sequence[Column]) -> None:
    if not joints:
        value = "{file: joints.csv}"
        text.add(
            "joints", value, "no columns are called like joints; a second file has configuration, joint_1 [deg] .."
        )
        return
    text.lines.append("joints:")
    because = "their names" if joints[0].words else "their place"
    text.add("joints.columns", list_of(joints), because, f"  columns: {list_of(joints)}")
    units = [column.unit for column in joints]
    if all(unit in ("deg", "rad", "mm", "m", "um", "in") for unit in units) and len(set(units)) > 1:
        text.add("joints.units", f"[{', '.join(units)}]", "the headings", f"  units: [{', '.join(units)}]")
        return
    unit, why = angle_unit(joints)
    if "mrad" in units:
        unit, why = OPEN, "the headings say mrad, in which joints are not read: convert the columns"
    text.add("joints.unit", unit, why, f"  unit: {quoted(unit)}")


def _write_order(text: MappingText, label: Column | None, time: GuessedTime | None, pattern: str | None) -> None:
    """Write what tells the order of measurement, if anything seems to."""
    if time is not None:
        text.add("order", time.value, time.because)
        return
    if label is not None and pattern is None and not label.is_numeric:
        starts = {match[1] if (match := _NUMBERED.fullmatch(name)) else None for name in set(label.texts)}
        if len(starts) == 1 and None not in starts:
            text.add("order", "{by: labels}", "the labels are numbered; remove it if they were not measured so")


def _tried(guessed: Guessed, path: Path) -> Guessed:
    """Try an import with a guessed mapping, in memory."""
    content = validated(YAML(typ="safe", pure=True).load(guessed.text), MappingFile, "the guessed mapping")
    try:
        data = read_with(TableFiles(path, Path("the guessed mapping"), content, None))[0]
    except InputError as error:
        return replace(guessed, refusal=str(error))
    return replace(guessed, configurations=data.configurations, targets=data.targets)


@dataclass(frozen=True, eq=False, repr=False)
class GuessedMapping(Record):
    """A mapping file that a table seems to need."""

    guessed: Guessed  #: The mapping and what would come of it.
    out: Path | None = None  #: The file that holds it; None if none was written.

    @property
    def text(self) -> str:
        """The mapping file."""
        return self.guessed.text

    @property
    def guesses(self) -> tuple[Guess, ...]:
        """Every entry that was guessed, and what the guess rests on."""
        return self.guessed.guesses

    def blocks(self) -> Iterator[Block]:
        """Give what was guessed, and what is to be done."""
        guessed, destination = self.guessed, "" if self.out is None else f": {self.out}"
        yield say(
            f"Guessed {counted(len(self.guesses), 'entry').replace('entrys', 'entries')}{destination}",
            guesses=[{"entry": g.entry, "value": g.value, "because": g.because} for g in self.guesses],
        )
        words = "No columns are called like joint positions: name them, or the file that holds them."
        if guessed.open:
            words = f"Nothing in the file tells {listed(guessed.open)}: answer each '?'."
        elif guessed.refusal is not None:
            words = f"An import with it would be refused: {guessed.refusal}"
        elif guessed.configurations:
            many = counted(guessed.configurations, "configuration")
            words = f"An import with it would read {many}, targets {listed(guessed.targets)}."
        yield say(
            words,
            open=list(guessed.open),
            refusal=guessed.refusal,
            configurations=guessed.configurations,
            targets=list(guessed.targets),
        )
        yield say("Nothing is imported before every guess is confirmed: look at each, then write confirmed: yes.")


def guessed_mapping(asked: GuessMapping) -> GuessedMapping:
    """Guess the mapping of a table, and write it into a file that does not exist yet."""
    table = path_argument(asked.file, "file")
    out = None if asked.out is None else new_file(file_for(asked.out, table))
    with refusals_of("file"):
        guessed = guess_mapping(table)
    if out is not None:
        write_text(out, guessed.text)
    return GuessedMapping(guessed, out)
