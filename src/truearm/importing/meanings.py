"""What the columns of a table seem to hold, and the text of the mapping that is guessed from it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import cached_property
from itertools import pairwise, product
from typing import Final

import numpy as np

from truearm.engine.base.units import LENGTH_UNITS, SMALL_ANGLE_UNITS
from truearm.engine.data.readers.measuring_order import MIDNIGHT
from truearm.engine.robot.chain import Array
from truearm.importing.layouts import GON, NOTHING, UNITS, GuessedLayout, number_of

_IN_BRACKETS: Final = re.compile(r"\s*(?P<sign>[\[({])(?P<unit>[^\])}]*)[\])}]\s*")
#: Units of what is no position.
_OTHER_UNITS: Final = frozenset({"s", "ms", "us", "min", "h", "V", "mV", "A", "mA", "N", "kN", "Nm", "N m", "W", "%"})
_AT_THE_END: Final = re.compile(r"(?P<name>.*[^\s_/,])[\s_/,]+(?P<unit>[^\s_/,]+)\s*")
_GLUED: Final = re.compile("(?P<name>[XYZxyz])(?P<unit>mm|m|in)")
_TOKEN: Final = re.compile(r"[XYZ](?=(?:act|nom|meas|cmd|ist|soll)\b)|[A-Z]?[a-z]+|[A-Z]+(?![a-z])|[0-9]+|[^\W\d_]+")
#: Words before the number of a joint.
_JOINT: Final = frozenset({"joint", "joints", "jt", "axis", "ax", "achse", "gelenk", "j", "a", "q", "theta", "rax"})
_UR: Final = ("base", "shoulder", "elbow", "wrist1", "wrist2", "wrist3")
_YASKAWA: Final = tuple("slurbt")
_DEVIATION: Final = frozenset({"std", "stdev", "stddev", "sigma", "sd", "unc", "uncertainty", "σ"})
#: Letters of deviations, where an axis or a coverage stands beside them: alone they are speeds, paths and voltages.
_DEVIATION_LETTERS: Final = frozenset({"s", "u"})
#: Words of expanded uncertainties.
_EXPANDED: Final = frozenset({"k2", "u95", "95", "expanded", "2sigma"})
_NOT_MEASURED: Final = frozenset(
    {"nominal", "nom", "soll", "theoretical", "theo", "cad", "design", "cmd", "command", "commanded", "programmed"}
    | {"error", "err", "delta", "diff", "difference", "dev", "deviation", "residual", "rms", "tol", "tolerance"}
)
#: Words of what was measured, and of what is so called beside nominal positions.
_MEASURED: Final = frozenset({"meas", "measured", "measurement", "ist", "gemessen"})
_ACTUAL: Final = frozenset({"act", "actual"})
#: Words of three numbers that are no position.
_TURNED: Final = frozenset({"ori", "orient", "orientation", "rot", "rotation", "angle", "angles", "euler", "rotvec"})
_NO_POSITION: Final = _TURNED | {
    *("quat", "quaternion", "vel", "velocity", "speed", "acc", "accel", "acceleration", "gyro", "omega"),
    *("force", "torque", "moment", "normal", "offset", "correction", "corr", "weight"),
}
#: Letters of differences and velocities, where no other letters stand for targets.
_NO_TARGET: Final = frozenset({"d", "v"})
#: Words of positions that a controller shows or was given, where others stand beside them.
_TOOL: Final = frozenset({"tcp", "tool", "flange", "robot", "target", "desired", "setpoint", "reference"})
_LABEL: Final = frozenset(
    {"configuration", "config", "pose", "poses", "position", "pos", "point", "punkt", "label", "name", "id", "stelle"}
    | {"station", "group", "no", "nr", "number", "index", "pt", "measurement", "messung", "pkt"}
)
_TARGET: Final = frozenset(
    {"target", "ball", "smr", "reflector", "reflektor", "marker", "prism", "nest", "kugel", "feature", "body"}
)
_TIME: Final = frozenset(
    {"time", "timestamp", "stamp", "date", "datum", "zeit", "uhrzeit", "datetime", "when", "day", "tag", "clock"}
)
_VISIT: Final = frozenset({"visit", "round", "pass", "lap", "repeat", "repetition", "umlauf", "durchgang", "runde"})
_TEMPERATURE: Final = frozenset({"temp", "temperature", "temperatur"})
#: Angles about three axes by the names of their columns: axes, whether they turn along, and who writes so.
_ANGLES: Final = {
    ("a", "b", "c"): ("zyx", "moving", "KUKA's A, B, C"),
    ("w", "p", "r"): ("xyz", "fixed", "FANUC's W, P, R"),
    ("roll", "pitch", "yaw"): ("xyz", "fixed", "roll, pitch and yaw as ROS and most programs mean them"),
}


#: No instrument's uncertainty is larger [mm].
_LARGEST_UNCERTAINTY: Final = 10.0


@dataclass(frozen=True)
class Column:
    """A column: its place, name, unit in the heading, words of the name, and what stands in it.

    `foreign` is what stands where a unit belongs and is none that is known, such as V or mm/s.
    """

    place: int
    name: str
    unit: str
    words: tuple[str, ...]
    texts: tuple[str, ...]
    decimal: str
    foreign: str = ""

    @cached_property
    def filled(self) -> list[str]:
        """Return the cells that are not empty."""
        return [text for text in self.texts if text]

    @cached_property
    def values(self) -> Array:
        """Return the numbers that stand in it."""
        numbers = (number_of(text, self.decimal) for text in self.filled)
        return np.array([value for value in numbers if value is not None])

    @cached_property
    def nothing(self) -> list[str]:
        """Return the texts among its numbers that seem to mean that nothing was measured."""
        odd = dict.fromkeys(text for text in self.filled if number_of(text, self.decimal) is None)
        return [text for text in odd if NOTHING.fullmatch(text)]

    @property
    def is_numeric(self) -> bool:
        """Whether at least half of what stands in it are numbers, beside what seems to mean nothing."""
        meant = [text for text in self.filled if text not in self.nothing]
        return len(self.values) > 0 and 2 * len(self.values) >= len(meant)

    @property
    def can_name(self) -> bool:
        """Whether what stands in it can be names: texts, or whole numbers."""
        return not self.is_numeric or all(text.isdigit() for text in self.filled)

    @property
    def counts(self) -> bool:
        """Whether it numbers the rows: 1, 2, 3."""
        whole = len(self.values) == len(self.texts) > 1 and all(text.isdigit() for text in self.texts)
        return whole and bool((np.diff(self.values) == 1).all())

    @property
    def distinct(self) -> int:
        """How many different cells there are."""
        return len(set(self.texts))


Triple = tuple[Column, Column, Column]


def columns_of(layout: GuessedLayout) -> list[Column]:
    """Return the columns of a table."""
    columns = []
    for place, (name, heading, texts) in enumerate(zip(layout.names, layout.headings, layout.columns, strict=True)):
        bare, unit, foreign = _name_and_unit(heading) if layout.header else (heading, "", "")
        words = tuple(word.lower() for word in _TOKEN.findall(bare)) if layout.header else ()
        columns.append(Column(place, name, unit or layout.units[place], words, texts, layout.decimal, foreign))
    return columns


def _name_and_unit(heading: str) -> tuple[str, str, str]:
    """Return a heading without its unit, the unit, and what stands in its place where it is not known."""
    foreign = ""
    for match in _IN_BRACKETS.finditer(heading):
        inside = match["unit"].strip()
        bare = f"{heading[: match.start()]} {heading[match.end() :]}".strip()
        if unit := UNITS.get(inside):
            return bare, unit, ""
        if match["sign"] == "[" or inside in _OTHER_UNITS or "/" in inside:
            heading, foreign = bare, inside
            break
    for pattern in (_AT_THE_END, _GLUED):
        heading_match = pattern.fullmatch(heading)
        if not foreign and heading_match is not None and (unit := UNITS.get(heading_match["unit"].strip())):
            return heading_match["name"], unit, ""
    return heading, "", foreign


def joints_among(columns: Sequence[Column]) -> list[Column]:
    """Return the columns of the joints in their order, none if no names say so."""
    groups: dict[tuple[str, ...], dict[int, Column]] = {}
    for column in columns:
        words = column.words[:-1] if {*column.words[-1:]} & (_ACTUAL | _MEASURED) else column.words
        *before, number = words or ("",)
        if not before or not number.isdigit() or before[-1] not in _JOINT or _NOT_MEASURED & set(before):
            continue
        groups.setdefault(tuple(before), {}).setdefault(int(number), column)
    runs = [_run(group) for group in groups.values()]
    for words in (_UR, _YASKAWA):
        named = {"".join(column.words): column for column in columns}
        runs.append([named[word] for word in words] if all(word in named for word in words) else [])
    return max(runs, key=len, default=[])


def _run(columns: dict[int, Column]) -> list[Column]:
    """Return columns whose numbers follow each other from 0 or 1."""
    first = 0 if 0 in columns else 1
    run = []
    while first in columns:
        run.append(columns[first])
        first += 1
    return run


def triples_among(columns: Iterable[Column], last: Sequence[str]) -> dict[tuple[str, ...], Triple]:
    """Return three columns that are named alike but for a word, by the other words; deviations are left out."""
    groups: dict[tuple[str, ...], dict[str, Column]] = {}
    for column in columns:
        words = column.words
        for at in dict.fromkeys((len(words) - 1, 0)):
            if words and words[at] in last and (key := (*words[:at], *words[at + 1 :])) is not None:
                groups.setdefault(key, {}).setdefault(words[at], column)
                break
    return {
        key: (group[last[0]], group[last[1]], group[last[2]])
        for key, group in groups.items()
        if len(group) == 3 and not _NOT_MEASURED & set(key)
    }


def _may_be(columns: Iterable[Column], units: Sequence[str]) -> bool:
    """Return whether no column names a unit of something else."""
    return all(column.unit in ("", *units) and not column.foreign for column in columns)


def positions_among(columns: Sequence[Column]) -> dict[tuple[str, ...], Triple]:
    """Return the columns x, y, z of each target by the other words of their names."""
    columns = list(columns)
    positions = {
        key: three
        for key, three in triples_among(columns, "xyz").items()
        if not (_DEVIATION | _DEVIATION_LETTERS | _NO_POSITION) & set(key) and _may_be(three, LENGTH_UNITS)
    }
    if not positions:  # px, py, pz of ROS and tx, ty, tz of trackers, where nothing else is called like a position
        named = {column.words[0]: column for column in columns if len(column.words) == 1}
        glued = [[named.get(letter + axis) for axis in "xyz"] for letter in "pt"]
        for three in ([column for column in names if column is not None] for names in glued):
            if len(three) == 3 and _may_be(three, LENGTH_UNITS):
                return {(): (three[0], three[1], three[2])}
    letters = {key for key in positions if len("".join(key)) == 1}
    if all(_NO_TARGET & set(key) for key in letters):
        positions = {key: three for key, three in positions.items() if key not in letters}
    positions = {key: three for key, three in positions.items() if not (_NO_TARGET & set(key) and len(key) > 1)}
    beside_nominal = any(_NOT_MEASURED & set(column.words) for column in columns)
    for words in (_MEASURED, _ACTUAL if beside_nominal else frozenset[str]()):
        if chosen := {key: three for key, three in positions.items() if words & set(key)}:
            return chosen
    measured = {key: three for key, three in positions.items() if not (_TOOL & set(key) or _is_unit(three))}
    return measured or positions


def stand_ins_among(positions: Sequence[Triple], others: Sequence[Column]) -> tuple[list[str], str | None]:
    """Return numbers that stand for no reading, as -999 or 0 in all of x, y and z, and one that stands elsewhere too.

    `others` are further columns in which the texts would be taken for nothing.
    """
    stand_ins: dict[str, None] = {}
    elsewhere: list[str] = []
    somewhere: set[int] = set()
    for three in positions:
        rows = list(zip(*(column.texts for column in three), strict=True))
        numbers = [{number_of(text, three[0].decimal) for text in row} for row in rows]
        alike = {at for at, values in enumerate(numbers) if len(values) == 1 and None not in values}
        if 2 * len(alike) >= len(rows):
            alike = set()
        somewhere |= alike
        stand_ins.update(dict.fromkeys(text for at in sorted(alike) for text in rows[at]))
        elsewhere += [text for at, row in enumerate(rows) if at not in alike for text in row]
    elsewhere += [text for column in others for at, text in enumerate(column.texts) if at not in somewhere]
    return list(stand_ins), next((text for text in stand_ins if text in elsewhere), None)


def quaternion_among(columns: Sequence[Column]) -> tuple[list[Column], bool]:
    """Return the columns w, x, y, z of a quaternion, none if there is none, and whether their names say which is which.

    Four columns are one only if the sum of their squares is 1 in every row.
    """
    named = {"".join(column.words): column for column in columns}
    for names, sure in (
        (("qw", "qx", "qy", "qz"), True),
        (("q0", "qx", "qy", "qz"), True),
        (("rotw", "rotx", "roty", "rotz"), True),
        (("w", "x", "y", "z"), True),
        (("q0", "q1", "q2", "q3"), False),
        (("q1", "q2", "q3", "q4"), False),
    ):
        for start in ("", "quat", "quaternion", "orientation", "orient", "ori", "rotation", "rot", "pose"):
            four = [named[start + name] for name in names if start + name in named]
            if len(four) == 4 and _is_unit(four):
                return four, sure
    return [], True


def _is_unit(columns: Sequence[Column]) -> bool:
    """Return whether the sum of their squares is 1 in every row, as of quaternions and directions."""
    if len({len(column.values) for column in columns}) > 1 or not len(columns[0].values):
        return False
    length = np.sqrt(sum(column.values**2 for column in columns))
    return bool(np.abs(length - 1.0).max() < 1e-2)


def angles_among(columns: Sequence[Column]) -> tuple[Triple, str, str, str] | None:
    """Return three columns of angles, the axes, whether they turn along, and who writes so; ? where nothing tells."""
    for names, (about, axes, who) in _ANGLES.items():
        for three in triples_among(columns, names).values():
            if all(column.is_numeric for column in three):
                return three, about, axes, who
    for key, three in triples_among(columns, ("rx", "ry", "rz")).items():
        if not (_DEVIATION | _NO_TARGET) & set(key):
            return three, "?", "?", "names such as Rx do not say it"
    for key, three in triples_among(columns, "xyz").items():
        others = _DEVIATION | _DEVIATION_LETTERS | _NO_TARGET
        if _TURNED & set(key) and not others & set(key) and _is_turned(three):
            return three, "?", "?", f"names such as {three[0].name} do not say it"
    return None


def _is_turned(three: Triple) -> bool:
    return _may_be(three, SMALL_ANGLE_UNITS) and all(column.is_numeric for column in three)


def deviations_among(columns: Sequence[Column], of: Sequence[str]) -> list[Column]:
    """Return the columns with the deviations of x, y, z, or those of rx, ry, rz: one, three or none."""
    turned = tuple(of) != ("x", "y", "z")
    units = SMALL_ANGLE_UNITS if turned else LENGTH_UNITS
    columns = [column for column in columns if _may_be([column], units) and column.is_numeric]
    for key, three in triples_among(columns, of).items():
        if (_DEVIATION | _DEVIATION_LETTERS) & set(key):
            return [*three]
    for sign in ("u", "s"):
        named = {"".join(column.words): column for column in columns}
        if all(sign + axis in named for axis in of):
            return [named[sign + axis] for axis in of]
    if turned:
        return []
    plain = [
        column
        for column in columns
        if (_DEVIATION & set(column.words) or (_DEVIATION_LETTERS & set(column.words) and is_expanded([column])))
        and not (_TURNED | {"x", "y", "z"}) & set(column.words)
    ]
    alone = [column for column in columns if column.words == ("u",) and column.unit and _is_small(column)]
    return (plain or alone)[:1]


def _is_small(column: Column) -> bool:
    """Return whether what stands in a column can be uncertainties of an instrument: above zero, below a centimetre."""
    size = column.values * {"m": 1e3, "um": 1e-3, "in": 25.4}.get(column.unit, 1.0)
    return len(size) > 0 and bool((size > 0.0).all() and (size < _LARGEST_UNCERTAINTY).all())


def is_expanded(columns: Sequence[Column]) -> bool:
    """Return whether names say that deviations are expanded uncertainties, as a U alone does (JCGM 100:2008, 6.2)."""
    if len(columns) == 1 and columns[0].name[:1] == "U" and columns[0].words == ("u",) and columns[0].unit:
        return True
    return any(_EXPANDED & {*column.words, *map("".join, pairwise(column.words))} for column in columns)


def named_like(columns: Sequence[Column], kind: str) -> Column | None:
    """Return the first column that is called like a label, a target, a visit, a time or a temperature."""
    words = {"label": _LABEL, "target": _TARGET, "visit": _VISIT, "time": _TIME, "temperature": _TEMPERATURE}[kind]
    return next((column for column in columns if words & set(column.words)), None)


#: Where nothing in the file tells an answer.
OPEN: Final = "?"
_PLAIN: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]*(?: [A-Za-z0-9_]+)*")
_NOT_PLAIN: Final = frozenset({"true", "false", "null"})
#: Angles beyond this are degrees: nobody turns a joint more than once about itself and a little more [rad].
_MOST_RADIANS: Final = 7.0
#: Positions beyond this are millimetres: no arm reaches that many metres or inches away.
_MOST_METRES: Final = 30.0
#: Rows from which small angles are taken for radians.
_ENOUGH: Final = 10


@dataclass(frozen=True)
class Guess:
    """One entry of a mapping, and what the guess rests on."""

    entry: str  #: The entry, such as ``joints.unit``.
    value: str  #: Its value; ``?`` where nothing tells it.
    because: str  #: What the guess rests on.


@dataclass
class MappingText:
    """The lines of a mapping as they are written, and the guesses in them."""

    lines: list[str] = field(default_factory=list)
    guesses: list[Guess] = field(default_factory=list)

    def add(self, entry: str, value: str, because: str, line: str | None = None) -> None:
        """Add an entry with its guess; `line` is how it is written, if not by its name and value alone."""
        name = entry.rpartition(".")[2]
        self.lines.append(f"{line or f'{name}: {value}'}  # guess: {because}")
        self.guesses.append(Guess(entry, value, because))


def plain(text: str) -> str:
    """Return a text as YAML takes it."""
    is_plain = _PLAIN.fullmatch(text) is not None and text.lower() not in _NOT_PLAIN
    return text if is_plain else f'"{escaped(text)}"'


def named(column: Column) -> str:
    """Return the name of a column as YAML takes it; its number stays one."""
    return column.name if column.name.isdigit() else plain(column.name)


def escaped(text: str) -> str:
    """Return a text as it stands between double quotes in YAML."""
    known = {'"': '\\"', "\\": "\\\\"}
    return "".join(known.get(c, c if c.isprintable() else f"\\U{ord(c):08x}") for c in text)


def list_of(columns: Sequence[Column]) -> str:
    """Return the names of columns as a list in YAML."""
    return f"[{', '.join(map(named, columns))}]"


def quoted(unit: str) -> str:
    """Return a unit as YAML takes it, or the question for it."""
    return f"'{OPEN}'" if unit == OPEN else unit


def unit_of(columns: Sequence[Column]) -> str | None:
    """Return the unit that the headings of all these columns name, None if they do not agree."""
    units = {column.unit for column in columns}
    return units.pop() or None if len(units) == 1 else None


def angle_unit(columns: Sequence[Column]) -> tuple[str, str]:
    """Return the unit of angles and what it rests on."""
    units = list(dict.fromkeys(column.unit for column in columns))
    of_gon = next((unit for unit in units if unit in GON), None)
    if of_gon is not None:
        return OPEN, f"the headings say {of_gon}: 400 to a turn are not read, convert them; 360 to a turn are deg"
    if any(units):
        return (units[0], "the headings") if len(units) == 1 else (OPEN, "the headings do not name one unit for all")
    if not columns:
        return OPEN, "nothing tells the unit"
    most = max((float(np.abs(column.values).max()) for column in columns if len(column.values)), default=0.0)
    if most > _MOST_RADIANS:
        return "deg", f"{most:g} is too much for radians"
    if len(columns[0].values) >= _ENOUGH:
        return "rad", f"no angle is beyond {most:.3g}"
    return OPEN, f"deg or rad: no angle is beyond {most:.3g}"


def length_unit(columns: Sequence[Column]) -> tuple[str, str]:
    """Return the unit of positions and what it rests on."""
    unit = unit_of(columns)
    if unit is not None:
        return unit, "the headings"
    units = {column.unit for column in columns if column.unit}
    if len(units) == 1:
        return units.pop(), "the headings that name one"
    if units:
        return f"'{OPEN}'", "the headings name several units, and a mapping has one for all positions"
    most = max((float(np.abs(column.values).max()) for column in columns if len(column.values)), default=0.0)
    if most > _MOST_METRES:
        return "mm", f"{most:g} is too much for metres; it may be in"
    return f"'{OPEN}'", f"m, mm or in: no coordinate is beyond {most:.3g}"


_CLOCKS: Final = ("%H:%M:%S", "%H:%M:%S.%f", "%H:%M:%S,%f", "%I:%M:%S %p", "%H:%M", "%I:%M %p")
_DAYS: Final = (
    *("%d.%m.%Y", "%d.%m.%y", "%m/%d/%Y", "%d/%m/%Y", "%m/%d/%y", "%d/%m/%y", "%Y/%m/%d", "%d-%m-%Y", "%m-%d-%Y"),
    *("%d-%b-%Y", "%d-%b-%y", "%d %b %Y", "%b %d %Y", "%b %d, %Y", "%d %B %Y", "%Y.%m.%d"),
)
_BETWEEN: Final = (" ", ", ", "T", "_")
_FORMATS: Final = (
    "iso",
    *(f"{day}{between}{clock}" for day, clock, between in product(_DAYS, _CLOCKS, _BETWEEN)),
    *_CLOCKS,
)
#: Units of running times.
_SECONDS: Final = frozenset({"s", "sec", "ms", "us", "min", "h"})


@dataclass(frozen=True)
class GuessedTime:
    """What seems to tell the order of measurement."""

    #: The column that does, or one with the day and one with the time; none if there are times, and which of them does,
    #: or how, is not known.
    columns: tuple[Column, ...]
    value: str  #: The entry of the mapping.
    because: str  #: What it rests on.


def time_among(columns: Sequence[Column]) -> GuessedTime | None:
    """Return what tells the time of the rows; None if no column seems to, or all rows have the same."""
    of_time = []
    others = list(columns)
    while (column := named_like(others, "time")) is not None:
        others.remove(column)
        if len(set(column.filled)) > 1:
            of_time.append(column)
    if not of_time:
        return _running(columns)
    dates = [column for column in of_time if not column.is_numeric and all(map(_is_day, column.filled))]
    times = [column for column in of_time if column not in dates]
    if len(dates) == len(times) == 1 and _is_clock(times[0]) and len(dates[0].filled) == len(times[0].filled):
        return _of_columns(dates[0], times[0])
    if dates and (len(times) != 1 or _is_clock(times[0])):
        names = " and ".join(column.name for column in of_time)
        return _asked(f"{names} tell it together, or a day alone does not: write both into one column")
    return _of_columns(times[0])


def _asked(because: str) -> GuessedTime:
    return GuessedTime((), quoted(OPEN), f"{because}; {{column, time: %d.%m.%Y %H:%M:%S}}, {{by: rows}} or nothing")


def _running(columns: Sequence[Column]) -> GuessedTime | None:
    """Return a column t with a unit of time that rises from row to row."""
    for column in columns:
        if column.words == ("t",) and column.foreign in _SECONDS and column.is_numeric:
            if len(column.values) == len(column.texts) and bool((np.diff(column.values) > 0).all()):
                return GuessedTime((column,), f"{{column: {named(column)}}}", "its name and its unit; it rises")
            return _asked(f"{column.name} may be a time, and does not rise from row to row")
    return None


def _of_columns(column: Column, clock: Column | None = None) -> GuessedTime:
    if column.is_numeric:
        return GuessedTime((column,), f"{{column: {named(column)}}}", "its name")
    texts = column.filled
    if clock is not None:
        texts = [f"{_bare_day(day)} {time}" for day, time in zip(column.filled, clock.filled, strict=True)]
    who = column.name if clock is None else f"{column.name} and {clock.name}"
    formats = [way for way in _FORMATS if all(_reads(text, way) for text in texts)]
    if not formats:
        return _asked(f"the times in {who}, such as {texts[0][:40]}, are of no format that is known")
    orders = {tuple(sorted(texts, key=lambda text: _moment(text, way))) for way in formats}
    if len(orders) > 1:
        return _asked(f"{formats[0]} and {formats[1]} both read {who}, and tell different orders")
    shown = "iso" if formats[0] == "iso" else f"'{formats[0]}'"
    because = "its name and its texts" if clock is None else "their names and their texts"
    if len(formats) > 1:
        because = f"{because.rpartition(' and ')[2]}; {formats[1]} would read them too"
    if clock is not None:
        value = f"{{columns: [{named(column)}, {named(clock)}], time: {shown}}}"
        return GuessedTime((column, clock), value, because)
    return GuessedTime((column,), f"{{column: {named(column)}, time: {shown}}}", because)


def _is_clock(column: Column) -> bool:
    """Return whether the texts of a column are times without a day."""
    return any(all(_reads(text, way) for text in column.filled) for way in _CLOCKS)


def _is_day(text: str) -> bool:
    return any(_reads(_bare_day(text), way) for way in ("%Y-%m-%d", *_DAYS))


def _bare_day(text: str) -> str:
    """Return a day without what a workbook adds to it."""
    return text.removesuffix(MIDNIGHT)


def _reads(text: str, way: str) -> bool:
    try:
        _moment(text, way)
    except ValueError:
        return False
    return True


def _moment(text: str, way: str) -> str:
    """Return a time as a text that sorts as times do."""
    moment = datetime.fromisoformat(text) if way == "iso" else datetime.strptime(text, way)
    return (moment if moment.tzinfo is None else moment.astimezone(UTC)).isoformat(timespec="microseconds")
