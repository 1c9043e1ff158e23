"""What a calibration takes as known instead of finding it: base, targets and fixtures with their places from a file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError, did_you_mean, refusals_of
from truearm.engine.base.files import path_argument
from truearm.engine.data.dataset import Dataset
from truearm.engine.fit.fixed_places import NOTHING_FIXED, FixedPlaces
from truearm.engine.programs.cell import KnownPlace, read_known_places
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform

#: What may be held together, by a word.
_BASE: Final = "base"
_ALL: Final = ("targets", "fixtures")
_AS_BASE: Final = "quaternion: [1, 0, 0, 0]"


def fixed_places_argument(hold: Sequence[str], frames: object, robot: Robot, data: Dataset) -> FixedPlaces:
    """Return what is held, with its places from a file.

    Args:
        hold: ``base``, ``targets``, ``fixtures``, or targets and fixtures by name.
        frames: A file of the schema ``truearm-cell/1``: targets are its tools; base and fixtures its frames.
        robot, data: Of the calibration.

    Raises:
        InputError: If numbers are missing, if something is held that the readings do not have or do not see, or twice.
    """
    if not hold and frames is None:
        return NOTHING_FIXED
    if not hold:
        raise InputError(
            "frames are given, and nothing is held at them",
            parameter="frames",
            came=str(frames),
            cure="Say with `hold` what is known: base, targets, fixtures, or names.",
        )
    base, targets, fixtures = _named(hold, data)
    if frames is None:
        raise InputError(
            "what is held has no numbers",
            parameter="hold",
            came=", ".join(hold),
            cure="Give its places in a file with `frames`.",
        )
    with refusals_of("frames"):
        path = path_argument(frames, "frames")
        tools, places = read_known_places(robot, path)
        stands = None if not base else _base(places, robot, path)
        on_flange = {name: _target(tools, name, data, path) for name in targets}
        beside = {name: _fixture(places, name, data, stands, robot, path) for name in fixtures}
    if stands is not None and not data.anchored and not beside:
        raise InputError(
            "no reading says where the base stands, so nothing is known of it by holding it",
            parameter="hold",
            where=data.source,
            came=_BASE,
            cure="Hold the fixtures too, whose places in the same frame are known, or leave the base out.",
        )
    return FixedPlaces(stands, on_flange, beside)


def _named(hold: Sequence[str], data: Dataset) -> tuple[bool, tuple[str, ...], tuple[str, ...]]:
    """Return whether the base is held, and which targets and fixtures are."""
    seen = [data.targets[t] for t in dict.fromkeys(data.target[data.has_reading].tolist())]
    base, targets, fixtures = False, list[str](), list[str]()
    for name in hold:
        if name == _BASE:
            base = True
            continue
        if name in _ALL:
            known, chosen = (seen, targets) if name == "targets" else ([*data.fixtures], fixtures)
            if not known:
                raise InputError(
                    "the readings have no fixture",
                    parameter="hold",
                    where=data.source,
                    came=name,
                    cure="Leave it out; a fixture is what the column fixture names.",
                )
            more = known
        elif name in seen and name in data.fixtures:
            raise InputError(
                "a target and a fixture have this name",
                parameter="hold",
                where=data.source,
                came=name,
                cure="Write targets or fixtures, or give one of them another name.",
            )
        elif name in seen or name in data.fixtures:
            chosen, more = (targets, [name]) if name in seen else (fixtures, [name])
        else:
            known = [_BASE, *_ALL, *seen, *data.fixtures]
            raise InputError(
                "there is nothing of this name to hold",
                parameter="hold",
                where=data.source,
                came=name,
                allowed=", ".join(known),
                cure=did_you_mean(name, known),
            )
        twice = [text for text in more if text in chosen]
        if twice:
            raise InputError(
                "this is held twice", parameter="hold", came=f"{name} ({twice[0]})", cure="Name each once, or all."
            )
        chosen += more
    return base, tuple(targets), tuple(fixtures)


def _entry(entries: Mapping[str, KnownPlace], name: str, part: str, path: Path) -> KnownPlace:
    if name not in entries:
        raise InputError(
            f"{name} is held, and the file does not say where it is",
            parameter="frames",
            where=f"{path}, {part}",
            came=", ".join(entries) or "nothing",
            cure=did_you_mean(name, entries) or f"Add {name} under {part}:, or do not hold it.",
        )
    return entries[name]


def _whole(entry: KnownPlace, subject: str) -> Transform:
    """Return a place with an orientation, which nobody may leave to chance."""
    if not entry.turned:
        raise InputError(
            f"{subject} has an orientation, and the entry does not say how it is turned",
            parameter="frames",
            where=entry.where,
            cure=f"Add its orientation, {_AS_BASE} if it is not turned.",
        )
    return entry.place


def _base(places: Mapping[str, KnownPlace], robot: Robot, path: Path) -> Transform:
    entry = _entry(places, _BASE, "frames", path)
    if entry.of == "base":
        raise InputError(
            "where the base stands has to be said in the instrument's frame",
            parameter="frames",
            where=entry.where,
            came="of: base",
            allowed="of: world",
            cure=f"If the instrument's frame is the robot's base, write of: world and {_AS_BASE}.",
        )
    return _whole(entry, "the base")


def _target(tools: Mapping[str, KnownPlace], name: str, data: Dataset, path: Path) -> Transform:
    entry = _entry(tools, name, "tools", path)
    of_target = data.target == data.targets.index(name)
    turned = data.quaternion is not None and bool(np.isfinite(data.quaternion[of_target]).any())
    return _whole(entry, f"target {name}") if turned else entry.place


def _fixture(
    places: Mapping[str, KnownPlace], name: str, data: Dataset, base: Transform | None, robot: Robot, path: Path
) -> Transform:
    entry = _entry(places, name, "frames", path)
    if data.setup is not None and name in data.setup.targets:
        raise InputError(
            "the place of a fixture is known twice",
            parameter="frames",
            where=entry.where,
            came=f"held, and measured in a row of the role fixture in {data.source}",
            cure="Remove one of them.",
        )
    of_fixture = data.against == data.fixtures.index(name)
    counted = data.position[of_fixture][np.isfinite(data.position[of_fixture]).all(axis=1)]
    turned = data.quaternion is not None and bool(np.isfinite(data.quaternion[of_fixture]).any())
    over = data.height is not None and bool(np.isfinite(data.height[of_fixture]).any())
    has_axes = turned or over or bool(len(counted) and np.ptp(counted, axis=0).any())
    place = _whole(entry, f"fixture {name}") if has_axes else entry.place
    if entry.of == "world" and (base is not None or data.anchored):
        return place
    if entry.of == "base" and (base is not None or not data.anchored):
        stands = robot.base if base is None else base
        whole = stands.matrix @ place.matrix
        return Transform.from_matrix(whole[:3, :3], whole[:3, 3])
    unknown = "base" if entry.of == "base" else "world"
    raise InputError(
        "the base is found from the readings, so its frame is not known beforehand"
        if unknown == "base"
        else "no reading is in a frame of the instrument, so the world is the robot's base",
        parameter="frames",
        where=entry.where,
        came=f"of: {unknown}",
        allowed="of: world" if unknown == "base" else "of: base",
        cure="Hold the base too, or give the place in the other frame.",
    )
