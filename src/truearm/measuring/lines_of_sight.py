"""What of a plan an instrument can read: how far the readings reach, and what hides points from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError, Notice, Rule, Words, counted
from truearm.engine.motion.arm_capsules import ArmCapsules
from truearm.engine.motion.cell import KeepOut, box_distance, segment_distance
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.devices.device import Device
from truearm.measuring.session import Session

# Whether the readings of a plan reach as far as its configurations do: a data-entry error with units shows, and nothing
# else.

#: Of so many configurations the extent is compared, and it is told from so many times on.
_FEWEST: Final = 3
_TIMES: Final = 10.0


UNITS_UNLIKELY: Final = Rule(
    "units-unlikely",
    "warning",
    "the readings reach ten times as far as the configurations of the plan, or a tenth of it",
    cure="Check the unit of lengths, and that it is this plan.",
)


def extent_notices(session: Session, flange: Array) -> list[Notice]:
    """Return whether a target reaches ten times as far as the flange, or a tenth of it: its unit may be another one.

    That is no word on how well a reading fits.

    Args:
        flange: Where the nominal flange is at the configurations of the plan [m], ``(n, 3)``.
    """
    places = {label: number for number, label in enumerate(session.labels)}
    for name in session.targets:
        entries = [e for e in session.kept if e.name == name and e.reading is not None]
        if len(entries) < _FEWEST:
            continue
        read = _extent(np.array([e.reading.position for e in entries if e.reading is not None]))
        driven = _extent(flange[[places[e.label] for e in entries]])
        if driven and not 1.0 / _TIMES < read / driven < _TIMES:
            return [
                UNITS_UNLIKELY(
                    f"The readings of {name} at {len(entries)} configurations are {read * 1e3:.4g} mm apart, root mean "
                    f"square about their middle, and the flange of the robot {driven * 1e3:.4g} mm."
                )
            ]
    return []


def _extent(places: Array) -> float:
    """Return how far places ``(n, 3)`` are from their middle [m], the root of the mean square."""
    return float(np.sqrt(((places - places.mean(axis=0)) ** 2).sum(axis=1).mean()))


NOT_SEEN: Final = Rule(
    "not-seen",
    ("note", "warning"),
    "a virtual instrument cannot read all that is asked for: at some configurations nothing (warning), or of some "
    "targets (note)",
)


def sight_notices(session: Session, device: Device, placed: Robot, joints: Array) -> tuple[Notice, ...]:
    """Return what to know where a device cannot read all targets that are asked for.

    Args:
        placed: The nominal robot where the device sees it.
        joints: Of the plan, as the model counts them [rad or m], ``(n, joints)``.

    Raises:
        InputError: If it can read none of them at any configuration: a log of missed readings would be all that comes
            of it.
    """
    asked = np.array([[target.name in names for target in placed.targets] for names in session.asked])
    seen = asked & device.visible(placed, joints)
    of_pairs = f"of {counted(int(asked.sum()), 'pair')} of configuration and target"
    cure = f"`truearm plan` with `device={device.name}`, on the page Plan of the studio the field Instrument"
    if not seen.any():
        raise InputError(
            f"nothing of this plan can be read with the {device.name}: {device.reads_where}",
            parameter="plan",
            came=Words(f"0 {of_pairs} at which that is so"),
            cure=f"Plan with the instrument: {cure}.",
        )
    if (seen == asked).all():
        return ()
    blind = int((asked.any(axis=1) & ~seen.any(axis=1)).sum())
    nothing = f"none at {blind} of {counted(len(joints), 'configuration')}" if blind else "some at every configuration"
    return (
        NOT_SEEN(
            f"With the {device.name} {seen.sum()} {of_pairs} can be read, {nothing}: {device.reads_where}. The others "
            f"are left out. A plan that is made with the instrument asks for what it sees: {cure}.",
            "warning" if blind else "note",
        ),
    )


#: Half of the width of a beam, or of what a camera must see of a target [m].
BEAM: Final = 5e-3


def hidden(
    robot: Robot, joints: Array, eye: Array, points: Mapping[str, Array], boxes: Sequence[KeepOut] = ()
) -> list[dict[str, str]]:
    """Return which points cannot be seen at each configuration, and what hides them, in words.

    The links are as thick as a plan keeps them clear, see :class:`ArmCapsules`, each where the model has it: links
    beside parallel axes hide what their model hides.

    Args:
        robot: Where it stands.
        joints: As the model counts them [rad or m], ``(n, joints)``.
        eye: Where the instrument is, in the world [m], ``(3,)``.
        points: That are looked at, in the world [m], ``(3,)`` each.
        boxes: In the base frame.
    """
    base, arm = robot.base, ArmCapsules(robot)
    at = arm.points(joints)
    reasons: list[dict[str, str]] = [{} for _ in joints]

    def in_base(point: Array) -> Array:
        return np.asarray((point - np.array(base.translation)) @ base.rotation)[:, None]

    start = in_base(eye)
    for name, point in points.items():
        end = in_base(point)
        behind = [box.name for box in boxes if box_distance(start, end, box.low, box.high).item() < BEAM]
        near = np.zeros(len(joints), dtype=bool)
        for link in (*arm.links, *arm.tools):
            near |= segment_distance(at[link.start], at[link.end], start, end) < link.radius + BEAM
        for k, by_target in enumerate(reasons):
            if behind or near[k]:
                by_target[name] = f"the box {behind[0]!r}" if behind else "the arm"
    return reasons
