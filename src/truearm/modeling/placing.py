"""A robot at another place: with another base, other targets, other fixtures, all as nominal values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from truearm.modeling.fixtures import Fixture, FixtureKind
from truearm.modeling.parts import Target
from truearm.modeling.robot_data import ARM, STRUCTURE
from truearm.modeling.transform import Transform

if TYPE_CHECKING:
    from truearm.modeling.robot import Robot


def placed(robot: Robot, base: Transform, targets: Mapping[str, Transform | Sequence[float]]) -> Robot:
    """Return a robot at another place with other targets, as :meth:`truearm.Robot.with_frames` does."""
    kept = {n: p for n, p in robot.known.items() if p.group not in ("base", "target")}
    made, places = [], dict(zip(("base_x", "base_y", "base_z"), base.translation, strict=True))
    for name, place in targets.items():
        frame = place if isinstance(place, Transform) else None
        target = Target(name, frame.quaternion if frame else None)
        position = frame.translation if frame else place
        places |= {target.parameter(a): float(v) for a, v in zip("xyz", position, strict=True)}  # type: ignore[arg-type]
        made.append(target)
    moved = replace(robot, base_quaternion=base.quaternion, targets=tuple(made), known=kept)
    robot.share(moved, ARM)
    return moved.with_parameters(moved.parameters[n].restarted(v) for n, v in places.items())


def fixtures_placed(robot: Robot, places: Mapping[str, tuple[FixtureKind, Transform]]) -> Robot:
    """Return a robot with other fixtures beside it, as :meth:`truearm.Robot.with_fixtures` does."""
    kept = {n: p for n, p in robot.known.items() if p.group != "fixture"}
    made = tuple(Fixture(name, kind, place.quaternion) for name, (kind, place) in places.items())
    beside = replace(robot, fixtures=made, known=kept)
    robot.share(beside, STRUCTURE)
    values = {n: v for f, (_, place) in zip(made, places.values(), strict=True) for n, v in f.values_at(place).items()}
    return beside.with_parameters(beside.parameters[n].restarted(v) for n, v in values.items())
