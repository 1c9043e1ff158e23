"""Is the data believable on its own: before any robot is asked.

Targets on a rigid tool keep their distances, reference points beside the robot keep their places, and no two
readings of a real instrument agree to the last digit.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError, Notice, Rule, counted, millimetres, nearest_names
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.inclinations import Inclinations
from truearm.engine.data.rigid_tool import (
    DEVIATIONS,
    OUTLIERS,
    SAME_POINT,
    TARGET_MISTAKEN,
    TARGETS_SWAPPED,
    UNIT_LENGTH,
    UNMOVED,
    Suspect,
    constellation,
    named_configurations,
    places_of,
    rigid_suspects,
    scaled_distances,
)
from truearm.engine.data.thinning import check_duplicates, repeated_joints, repeated_joints_notices
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.urdf_writing import COLUMN

#: Temperatures of working arms [degC].
_COLDEST: Final = -30.0
_WARMEST: Final = 80.0
_MOST_NAMED: Final = 6
#: A reference point that is so far off at one configuration alone did not move, but was misread [m].
_FAR: Final = 0.02
#: A target read at this share of the configurations at most may be another one's misspelt name.
_FEW_SHARE: Final = 0.1
#: A target read at this share of the configurations or more is one that is always read.
_OFTEN_SHARE: Final = 0.8


def check_data(
    data: Dataset,
    suspects: Iterable[Suspect] | None = None,
    excluded: Mapping[str, int] | None = None,
    scaled: Collection[tuple[str, str]] = (),
) -> list[Notice]:
    """Return what is wrong with a dataset without asking a robot.

    Args:
        suspects: Readings that a robot doubts. At their configurations it tells which reading is wrong better than
            distances do.
        excluded: How many readings of each target are missing because they were excluded: nobody need be told that.
        scaled: Configuration and target of readings in another unit of length: nothing more is said of these.
    """
    notices = [*_misnamed(data), *_missing(data, excluded or {}), *check_duplicates(data)]
    data = _without(data, scaled)
    closer = _closer_together(data)
    notices += closer
    data = _without(data, {row for notice in closer for row in notice.at})
    pairs = repeated_joints(data)
    known = {label for pair in pairs for label in pair}
    known |= {label for notice in closer for label, _ in notice.at}
    doubted = [suspect for suspect in suspects or () if suspect.configuration not in known]
    notices += repeated_joints_notices(data, pairs)
    reported = {suspect.configuration for suspect in doubted}
    rigid = [suspect for suspect in rigid_suspects(data) if suspect.configuration not in reported]
    notices += suspect_notices([*rigid, *reference_suspects(data), *doubted])
    return notices + _moved(data) + _temperatures(data)


def _without(data: Dataset, rows: Collection[tuple[str, str]]) -> Dataset:
    """Return data without the positions of some readings, and of the reference points at their configurations.

    Args:
        rows: Configuration and target of each.
    """
    if not rows:
        return data
    names = zip(data.configuration.tolist(), data.target.tolist(), strict=True)
    left_out = np.array([(data.labels[c], data.targets[t]) in rows for c, t in names], dtype=bool)
    references = data.references
    if references is not None:
        affected = np.isin(references.configuration, data.configuration[left_out])
        references = replace(references, position=np.where(affected[:, None], np.nan, references.position))
    return replace(data, position=np.where(left_out[:, None], np.nan, data.position), references=references)


def _closer_together(data: Dataset) -> list[Notice]:
    """Say at which configurations the targets lie as in another unit of length."""
    notices = []
    for by, members in scaled_distances(data).items():
        size = f"{max(by, 1.0 / by):g} times"
        comparison = f"{size} closer together" if by > 1.0 else f"{size} farther apart"
        rows = np.flatnonzero(np.isin(data.configuration, members) & data.has_position).tolist()
        notices.append(
            UNIT_LENGTH(
                f"The targets lie {comparison} at {named_configurations(data.labels, members)} than at the others: the "
                "positions there, or those of the others, are in another unit of length. Fix their numbers.",
                at=tuple((data.labels[data.configuration[r]], data.targets[data.target[r]]) for r in rows),
            )
        )
    return notices


TEMPERATURE_UNLIKELY: Final = Rule("temperature-unlikely", "warning", "temperatures below -30 or above 80 degC")


def _temperatures(data: Dataset) -> list[Notice]:
    """Say if an arm would be colder or warmer than arms are."""
    if data.temperature is None:
        return []
    low, high = float(data.temperature.min()), float(data.temperature.max())
    if low >= _COLDEST and high <= _WARMEST:
        return []
    return [
        TEMPERATURE_UNLIKELY(
            f"The temperature goes from {low:g} to {high:g} degC; arms work between {_COLDEST:g} and {_WARMEST:g}. "
            "Is it in kelvin or degrees Fahrenheit?"
        )
    ]


class Ranged(Protocol):
    """An instrument that cannot read everything."""

    @property
    def name(self) -> str:
        """Its short name."""

    @property
    def summary(self) -> str:
        """What it is and reads, in words."""

    def beyond_range(self, data: Dataset) -> NDArray[np.bool_]:
        """Return which readings it cannot have read, ``(readings,)``."""


BEYOND_RANGE: Final = Rule(
    "beyond-range",
    "warning",
    "readings outside the range of the instrument that `device` names",
    cure="Check the units, and that it was this device.",
)


def check_range(data: Dataset, device: Ranged) -> list[Notice]:
    """Say which readings are beyond the range of the device that they are said to come from."""
    beyond = np.flatnonzero(device.beyond_range(data)).tolist()
    if not beyond:
        return []
    at = [(data.labels[data.configuration[r]], data.targets[data.target[r]]) for r in beyond]
    words = _listed(["/".join(reading) for reading in at])
    return [
        BEYOND_RANGE(
            f"{counted(len(beyond), 'reading')} {_are(beyond)} beyond what the device {device.name} can read "
            f"(configuration/target): {words}. It is a {device.summary}.",
            at=tuple(at),
        )
    ]


def suspect_notices(suspects: Sequence[Suspect]) -> list[Notice]:
    """Return one notice for each kind of suspicion; of a reading the one that says most.

    Args:
        suspects: What was found, of some readings more than once.
    """
    advice = {
        OUTLIERS: (
            "reading is far from where it must be",
            "Measure it again or leave it out; `loss=cauchy` lets it count little.",
            "readings are far from where they must be",
            "Measure them again or leave them out; `loss=cauchy` lets them count little.",
        ),
        TARGETS_SWAPPED: (
            "target was taken for another one of its configuration",
            "Exchange their names in the file.",
            "targets of the same configuration were taken for each other",
            "Exchange their names in the file.",
        ),
        TARGET_MISTAKEN: (
            "reading was taken from another point than it names",
            "Leave these cells empty, or measure it again.",
            "readings were taken from another point than they name",
            "Leave these cells empty, or measure them again.",
        ),
    }
    firsts: dict[tuple[str, str], Suspect] = {}
    for rule in (TARGETS_SWAPPED, TARGET_MISTAKEN, OUTLIERS):
        for suspect in suspects:
            if suspect.rule == rule:
                firsts.setdefault((suspect.configuration, suspect.target), suspect)
    notices = []
    for rule, words in advice.items():
        of_rule = [s for s in dict.fromkeys(suspects) if s.rule == rule and firsts[s.configuration, s.target] == s]
        if of_rule:
            fault, cure = words[:2] if len(of_rule) == 1 else words[2:]
            named = [f"{s.configuration}/{s.target}{f' ({s.words})' if s.words else ''}" for s in of_rule]
            message = f"{len(of_rule)} {fault} (configuration/target): {_listed(named)}. {cure}"
            notices.append(rule(message, at=tuple((s.configuration, s.target) for s in of_rule)))
    return notices


# -- reference points --------------------------------------------------------------------------------------


def reference_suspects(data: Dataset) -> list[Suspect]:
    """Doubt readings of reference points that were taken from a target, or from another reference point."""
    return [suspect for _, _, suspect in _mistaken_references(data)]


def clean_references(data: Dataset) -> Array | None:
    """Return the reference points, ``(configurations, points, 3)``, without mistaken readings; None without any."""
    if data.references is None:
        return None
    points = constellation(data.references)
    for c, t, _ in _mistaken_references(data):
        points[c, t] = np.nan
    return points


def _mistaken_references(data: Dataset) -> list[tuple[int, int, Suspect]]:
    if data.references is None:
        return []
    points, targets = constellation(data.references), places_of(data)
    usual, off, allowed = _places(points)
    names = data.references.targets
    suspects = []
    for c, t in np.argwhere(off > max(allowed, SAME_POINT)).tolist():
        rows = targets.at(c)
        known = {
            f"target {data.targets[n]}": targets.position[k] for k, n in enumerate(targets.target[rows], rows.start)
        }
        known |= {f"reference {n}": p for k, (n, p) in enumerate(zip(names, usual, strict=True)) if k != t}
        gaps = {name: float(np.linalg.norm(points[c, t] - place)) for name, place in known.items()}
        nearest = min(gaps, key=lambda name: gaps[name] if np.isfinite(gaps[name]) else np.inf, default="")
        neighbours = [k for k in (c - 1, c + 1) if 0 <= k < data.configurations and np.isfinite(off[k, t])]
        alone = bool(neighbours) and all(off[k, t] <= allowed for k in neighbours)
        if nearest and gaps[nearest] < SAME_POINT:
            suspects.append((c, t, Suspect(TARGET_MISTAKEN, data.labels[c], names[t], f"is {nearest}")))
        elif alone and off[c, t] > _FAR:
            suspects.append((c, t, Suspect(OUTLIERS, data.labels[c], names[t], f"{millimetres(off[c, t])} mm off")))
    return suspects


def _places(points: Array) -> tuple[Array, Array, float]:
    """Return usual places, how far each reading is from them, and how far it may be."""
    usual = _nanmedian(points)
    off = np.linalg.norm(points - usual, axis=2)
    return usual, off, max(UNMOVED, DEVIATIONS * float(_nanmedian(off.reshape(-1))))


REFERENCE_MOVED: Final = Rule(
    "reference-moved", "warning", "reference points beside the robot that moved by more than 0.1 mm"
)


def _moved(data: Dataset) -> list[Notice]:
    points = clean_references(data)
    if points is None or data.references is None:
        return []
    _, off, allowed = _places(points)
    moved: NDArray[np.bool_] = np.asarray(off > allowed)
    if not moved.any():
        return []
    rows = np.flatnonzero(moved.any(axis=1))
    names = [n for n, is_moved in zip(data.references.targets, np.any(moved, axis=0).tolist(), strict=True) if is_moved]
    return [
        REFERENCE_MOVED(
            f"Reference points moved by up to {float(np.nanmax(off)) * 1e3:.2f} mm ({', '.join(names)}; "
            f"{counted(len(rows), 'configuration')}: {_listed([data.labels[c] for c in rows])}). The robot's table "
            "or the instrument moved: where three points moved together the motion is removed, elsewhere leave these "
            "configurations out or measure them again.",
            at=tuple((data.labels[c], data.references.targets[t]) for c, t in np.argwhere(moved).tolist()),
        )
    ]


def check_joints(robot: Robot, data: Dataset | Inclinations) -> None:
    """Refuse data whose joints are not the robot's.

    Raises:
        InputError: Naming the counts, or the joint whose unit does not fit.
    """
    column = COLUMN["model" if data.joints_are == "model" else "controller"]
    if data.joints.shape[1] != len(robot.joints):
        raise InputError(
            "the number of joints differs from the robot's",
            where=data.source,
            came=counted(data.joints.shape[1], "joint column"),
            allowed=f"{len(robot.joints)} ({robot.name})",
            cure=f"Give one column {column}_i for each joint of the robot, base first.",
        )
    for number, (joint, kind) in enumerate(zip(robot.joints, data.joint_kinds, strict=True), 1):
        if joint.kind != kind:
            units = {"revolute": "deg or rad", "prismatic": "mm, m, um or in"}
            raise InputError(
                f"joint {number} of {robot.name} is {joint.kind}, but its column has a unit of a {kind} joint",
                where=f"{data.source}, column {column}_{number}",
                allowed=units[joint.kind],
            )


# -- bookkeeping -------------------------------------------------------------------------------------------


MISSING: Final = Rule("missing", "warning", "empty readings", gravity=0)


def _missing(data: Dataset, excluded: Mapping[str, int]) -> list[Notice]:
    counts: dict[str, int] = {}
    for part in [data] if data.references is None else [data, data.references]:
        names = len(part.targets)
        empty = np.bincount(part.target[~part.has_reading], minlength=names)
        of, read = np.divmod(np.unique(part.configuration * max(names, 1) + part.target), max(names, 1))
        times = np.bincount(read, minlength=names)
        # Against fixtures, and by several instruments, not every target is read at every configuration; nor where
        # targets are measured in turn, one at each configuration, or each once.
        in_turn = names > 1 and len(read) == len(np.unique(of))
        once = part.configurations > 1 and names > 1 and int(times.max()) == 1
        everywhere = data.fixture is None and not in_turn and not once
        # Fixed points are measured in rounds: one is missing where another one was read.
        among = part.configurations if part is data else len(np.unique(of))
        absent = among - times if everywhere else np.zeros(names, dtype=np.intp)
        counts |= dict(zip(part.targets, (empty + absent).tolist(), strict=True))
    counts = {name: max(count - excluded.get(name, 0), 0) for name, count in counts.items()}
    total = sum(counts.values())
    if total == 0:
        return []
    words = _listed([f"{count} of target {name}" for name, count in counts.items() if count])
    left = "is missing ({}). It is left out" if total == 1 else "are missing ({}). They are left out"
    return [MISSING(f"{counted(total, 'reading')} {left.format(words)}; nothing needs to be done.")]


TARGET_MISSPELT: Final = Rule(
    "target-misspelt",
    "error",
    "a name of a target that stands where another one is missing; two names that differ in case, blanks, hyphens or "
    "leading zeros, or are like each other at the same point of the flange, and are never read together",
)


def _misnamed(data: Dataset) -> list[Notice]:
    """Say which names of targets seem to be misspelt.

    A target that is read at a few configurations, at all of which another one is missing that is read everywhere else,
    is that one, if the names are alike; and a configuration that has one target twice and another one not at all.
    """
    if data.fixture is not None or len(data.targets) < 2:
        return []
    read = data.has_reading
    seen: list[set[int]] = [set() for _ in data.targets]
    twice: list[tuple[int, int]] = []
    for t, c in zip(data.target[read].tolist(), data.configuration[read].tolist(), strict=True):
        if c in seen[t]:
            twice.append((t, c))
        seen[t].add(c)
    often = [t for t, at in enumerate(seen) if len(at) >= _OFTEN_SHARE * data.configurations]
    hints = []
    alike = {name.casefold(): name for name in (data.targets[t] for t in often)}
    for t, at in enumerate(seen):
        if not at or len(at) > _FEW_SHARE * data.configurations:
            continue
        name = data.targets[t]
        meant = [alike[n] for n in nearest_names(name.casefold(), list(alike), 3)]
        for other in meant:
            if not at & seen[data.targets.index(other)]:
                labels = _listed([data.labels[c] for c in sorted(at)])
                hints.append(f"{name} at {labels}, where {other} is missing: did you mean {other}?")
                break
    written = {_as_meant(name): name for name in reversed(data.targets)}
    for t, name in enumerate(data.targets):
        first = written[_as_meant(name)]
        if first != name and seen[t] and not seen[t] & seen[data.targets.index(first)] and not _named(name, hints):
            hints.append(f"{first} and {name} are never read together: are they one target?")
    for t, c in twice:
        lost = [data.targets[o] for o in often if c not in seen[o]]
        if len(lost) == 1:
            hints.append(f"{data.targets[t]} is there twice at {data.labels[c]}, and {lost[0]} not at all")
    if not hints:
        return []
    return [
        TARGET_MISSPELT(
            f"Names look misspelt: {'; '.join(hints[:_MOST_NAMED])}. A misspelt name is a target of its own. "
            "Correct the names."
        )
    ]


def _as_meant(name: str) -> str:
    """Return a name without what is easily written in two ways: case, blanks, hyphens and leading zeros."""
    return re.sub(r"(?<![0-9])0+(?=[0-9])", "", re.sub(r"[\s_-]", "", name.casefold()))


def _named(name: str, hints: Sequence[str]) -> bool:
    return any(words.startswith(f"{name} at ") for words in hints)


def _are(things: Sequence[object]) -> str:
    return "is" if len(things) == 1 else "are"


def _listed(words: Sequence[str]) -> str:
    more = len(words) - _MOST_NAMED
    return ", ".join(words[:_MOST_NAMED]) + (f" and {more} more" if more > 0 else "")


def _nanmedian(values: Array) -> Array:
    """Median along the first axis without NaN, NaN where there is nothing."""
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return np.asarray(np.nanmedian(values, axis=0))
