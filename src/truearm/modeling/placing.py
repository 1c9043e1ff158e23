"""A robot at another place: with another base, other targets, other fixtures, all as nominal values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final, get_args

from truearm.arrays import number_array
from truearm.errors import wrong_kind
from truearm.modeling.fixtures import Fixture, FixtureKind
from truearm.modeling.parts import Target
from truearm.modeling.robot_data import ARM, STRUCTURE
from truearm.modeling.transform import Transform

if TYPE_CHECKING:
    from truearm.modeling.robot import Robot


#: Where a target is on the flange.
_PLACE: Final = "a Transform, or three coordinates in m"


def placed(robot: Robot, base: Transform, targets: Mapping[str, Transform | Sequence[float]]) -> Robot:
    """Return a robot at another place with other targets, as :meth:`truearm.Robot.with_frames` does."""
    _refuse_other(base, Transform, "base", "a Transform")
    _refuse_other(targets, Mapping, "targets", "a mapping from names to places")
    kept = {n: p for n, p in robot.known.items() if p.group not in ("base", "target")}
    made, places = [], dict(zip(("base_x", "base_y", "base_z"), base.translation, strict=True))
    for name, place in targets.items():
        _refuse_other(name, str, "targets", "a name for each place")
        frame = place if isinstance(place, Transform) else None
        position = number_array(frame.translation if frame else place, "targets", (3,), allowed=_PLACE).tolist()
        target = Target(name, frame.quaternion if frame else None)
        places |= {target.parameter(a): v for a, v in zip("xyz", position, strict=True)}
        made.append(target)
    moved = replace(robot, base_quaternion=base.quaternion, targets=tuple(made), known=kept)
    robot.share(moved, ARM)
    return moved.with_parameters(moved.parameters[n].restarted(v) for n, v in places.items())


def fixtures_placed(robot: Robot, places: Mapping[str, tuple[FixtureKind, Transform]]) -> Robot:
    """Return a robot with other fixtures beside it, as :meth:`truearm.Robot.with_fixtures` does."""
    _refuse_other(places, Mapping, "places", "a mapping from names to kinds and transforms")
    for name, entry in places.items():
        _refuse_other(name, str, "places", "a name for each fixture")
        fits = isinstance(entry, tuple) and len(entry) == 2 and isinstance(entry[1], Transform)
        if not fits or not isinstance(entry[0], str) or entry[0] not in get_args(FixtureKind):
            allowed = f"a kind ({', '.join(get_args(FixtureKind))}) and a Transform"
            raise wrong_kind("this says nothing of a fixture", entry, "places", allowed, where=name)
    kept = {n: p for n, p in robot.known.items() if p.group != "fixture"}
    made = tuple(Fixture(name, kind, place.quaternion) for name, (kind, place) in places.items())
    beside = replace(robot, fixtures=made, known=kept)
    robot.share(beside, STRUCTURE)
    values = {n: v for f, (_, place) in zip(made, places.values(), strict=True) for n, v in f.values_at(place).items()}
    return beside.with_parameters(beside.parameters[n].restarted(v) for n, v in values.items())


def _refuse_other(given: object, kind: type, parameter: str, allowed: str) -> None:
    if not isinstance(given, kind):
        raise wrong_kind("an object of another kind belongs here", given, parameter, allowed)
