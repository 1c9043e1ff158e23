"""What the columns of a table seem to hold, by their names and by what stands in them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Final

import numpy as np

from truearm.measurement.readers.guessing.layouts import NOTHING, UNITS, GuessedLayout, number_of
from truearm.modeling.chain import Array
from truearm.units import LENGTH_UNITS, SMALL_ANGLE_UNITS

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
    def given(self) -> list[str]:
        """Return the cells that are not empty."""
        return [text for text in self.texts if text]

    @cached_property
    def values(self) -> Array:
        """Return the numbers that stand in it."""
        found = (number_of(text, self.decimal) for text in self.given)
        return np.array([value for value in found if value is not None])

    @cached_property
    def nothing(self) -> list[str]:
        """Return the texts among its numbers that seem to mean that nothing was measured."""
        odd = dict.fromkeys(text for text in self.given if number_of(text, self.decimal) is None)
        return [text for text in odd if NOTHING.fullmatch(text)]

    @property
    def is_numeric(self) -> bool:
        """Whether at least half of what stands in it are numbers, beside what seems to mean nothing."""
        meant = [text for text in self.given if text not in self.nothing]
        return len(self.values) > 0 and 2 * len(self.values) >= len(meant)

    @property
    def can_name(self) -> bool:
        """Whether what stands in it can be names: texts, or whole numbers."""
        return not self.is_numeric or all(text.isdigit() for text in self.given)

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
    made = []
    for place, (name, heading, texts) in enumerate(zip(layout.names, layout.headings, layout.columns, strict=True)):
        bare, unit, foreign = _name_and_unit(heading) if layout.header else (heading, "", "")
        words = tuple(word.lower() for word in _TOKEN.findall(bare)) if layout.header else ()
        made.append(Column(place, name, unit or layout.units[place], words, texts, layout.decimal, foreign))
    return made


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
        found = pattern.fullmatch(heading)
        if not foreign and found is not None and (unit := UNITS.get(found["unit"].strip())):
            return found["name"], unit, ""
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
    runs = [_run(found) for found in groups.values()]
    for words in (_UR, _YASKAWA):
        named = {"".join(column.words): column for column in columns}
        runs.append([named[word] for word in words] if all(word in named for word in words) else [])
    return max(runs, key=len, default=[])


def _run(found: dict[int, Column]) -> list[Column]:
    """Return columns whose numbers follow each other from 0 or 1."""
    first = 0 if 0 in found else 1
    run = []
    while first in found:
        run.append(found[first])
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
        key: (found[last[0]], found[last[1]], found[last[2]])
        for key, found in groups.items()
        if len(found) == 3 and not _NOT_MEASURED & set(key)
    }


def _may_be(columns: Iterable[Column], units: Sequence[str]) -> bool:
    """Return whether no column names a unit of something else."""
    return all(column.unit in ("", *units) and not column.foreign for column in columns)


def positions_among(columns: Sequence[Column]) -> dict[tuple[str, ...], Triple]:
    """Return the columns x, y, z of each target by the other words of their names."""
    columns = list(columns)
    found = {
        key: three
        for key, three in triples_among(columns, "xyz").items()
        if not (_DEVIATION | _DEVIATION_LETTERS | _NO_POSITION) & set(key) and _may_be(three, LENGTH_UNITS)
    }
    if not found:  # px, py, pz of ROS and tx, ty, tz of trackers, where nothing else is called like a position
        named = {column.words[0]: column for column in columns if len(column.words) == 1}
        glued = [[named.get(letter + axis) for axis in "xyz"] for letter in "pt"]
        for three in ([column for column in names if column is not None] for names in glued):
            if len(three) == 3 and _may_be(three, LENGTH_UNITS):
                return {(): (three[0], three[1], three[2])}
    letters = {key for key in found if len("".join(key)) == 1}
    if all(_NO_TARGET & set(key) for key in letters):
        found = {key: three for key, three in found.items() if key not in letters}
    found = {key: three for key, three in found.items() if not (_NO_TARGET & set(key) and len(key) > 1)}
    beside_nominal = any(_NOT_MEASURED & set(column.words) for column in columns)
    for words in (_MEASURED, _ACTUAL if beside_nominal else frozenset[str]()):
        if chosen := {key: three for key, three in found.items() if words & set(key)}:
            return chosen
    measured = {key: three for key, three in found.items() if not (_TOOL & set(key) or _is_unit(three))}
    return measured or found


def stand_ins_among(positions: Sequence[Triple], others: Sequence[Column]) -> tuple[list[str], str | None]:
    """Return numbers that stand for no reading, as -999 or 0 in all of x, y and z, and one that stands elsewhere too.

    `others` are further columns in which the texts would be taken for nothing.
    """
    found: dict[str, None] = {}
    kept: list[str] = []
    somewhere: set[int] = set()
    for three in positions:
        rows = list(zip(*(column.texts for column in three), strict=True))
        numbers = [{number_of(text, three[0].decimal) for text in row} for row in rows]
        alike = {at for at, values in enumerate(numbers) if len(values) == 1 and None not in values}
        if 2 * len(alike) >= len(rows):
            alike = set()
        somewhere |= alike
        found.update(dict.fromkeys(text for at in sorted(alike) for text in rows[at]))
        kept += [text for at, row in enumerate(rows) if at not in alike for text in row]
    kept += [text for column in others for at, text in enumerate(column.texts) if at not in somewhere]
    return list(found), next((text for text in found if text in kept), None)


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
