"""A rehearsal of the ballbar on a digital twin: six lengths, tool changers, sessions, filled sheets, a fourth cup."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.base.units import COLUMN as SIMULATED
from truearm.engine.base.units import YES
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.dataset_fields import distinct_labels
from truearm.engine.data.hexapod import DEVICE, Design, Device, side_names, tool_cups, triangle
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform, rotation_from_quaternion
from truearm.engine.twin.twin import Twin
from truearm.hexapod.sheet import (
    SIDES_OF_FOUR,
    TO_FOURTH,
    PlannedRow,
    four_cups,
    sheet_csv,
    side_distances,
    side_frames,
)


@dataclass
class Ballbar:
    """A ballbar in use."""

    device: Device  #: Its range and noise.
    rng: np.random.Generator  #: For the noise.
    #: What each reading adds to the next ones until the bar is initialised again [m]. Nubiola (3.5) saw as much as 3 um
    #: after many readings.
    drift: float = 0.0
    _readings: int = 0

    def initialise(self) -> None:
        """Put the bar on its calibrator: the drift begins anew."""
        self._readings = 0

    def read(self, distance: Array, nominal: float) -> Array:
        """Return what it reads of true distances [m], one after the other; NaN beyond its range."""
        number = self._readings + np.arange(distance.size).reshape(distance.shape)
        self._readings += distance.size
        read = distance + self.device.sigma * self.rng.standard_normal(distance.shape) + self.drift * number
        return np.where(np.abs(read - nominal) <= self.device.reach, read, np.nan)


def ballbar(rng: np.random.Generator, device: Device = DEVICE, drift: float = 0.0) -> Ballbar:
    """Return a ballbar that was just initialised."""
    return Ballbar(device, rng, drift)


def measured_sides(bar: Ballbar, cups: Array, fixture: str) -> dict[str, float]:
    """Return the distances 12, 23, 31 of a fixture that were in range, by name, from its true cups ``(3, 3)`` [m]."""
    nominal = bar.device.base if fixture == "B" else bar.device.tool
    read = bar.read(np.linalg.norm(cups - np.roll(cups, -1, axis=0), axis=1), nominal)
    return {name: value for name, value in zip(side_names(fixture), read.tolist(), strict=True) if np.isfinite(value)}


def measured_legs(bar: Ballbar, design: Design, base_cups: Array, tool_cups: Array) -> dict[str, float]:
    """Return the legs of a design that were in range, by name, from the true cups, each ``(3, 3)`` [m]."""
    true = np.array([np.linalg.norm(tool_cups[tool] - base_cups[base]) for base, tool in design.legs])
    read = zip(design.leg_names, bar.read(true, bar.device.leg).tolist(), strict=True)
    return {name: value for name, value in read if np.isfinite(value)}


# A tool changer: the tool sits a little differently after every attachment (Nubiola, 3.5).
#
# The coupling lies at the flange, so the tool is shifted and turned about the flange's origin. What stands far from it
# moves most.

#: Deviation of a coordinate [m] and of a turn about each axis [rad]. Nubiola (3.5) saw T3, 195 mm from the flange's
#: origin, "as much as 0.100 mm" off between two attachments: that is the largest of ten pairs, three times in four due
#: to the turns. ATI states 0.010 mm for its QC-5.
SHIFT: Final = 0.010e-3
TURN: Final = 0.15e-3


@dataclass(frozen=True)
class ToolChanger:
    """A tool changer in use."""

    rng: np.random.Generator  #: For what it does not repeat.
    shift: float = SHIFT  #: Standard deviation of each coordinate of the tool [m].
    turn: float = TURN  #: Standard deviation of its turn about each axis of the flange [rad].

    def attached(self, twin: Twin) -> Twin:
        """Return the twin with its tool attached anew: its targets moved as one body on the flange.

        The tool's weight stays where it was: a tenth of a millimetre changes no moment that matters.
        """
        half = np.array([1.0, *(self.turn / 2 * self.rng.standard_normal(3))])
        R = rotation_from_quaternion(half / np.linalg.norm(half))
        p = self.shift * self.rng.standard_normal(3)
        robot, values = twin.robot, twin.robot.values
        targets: dict[str, list[float]] = {}
        for target in robot.targets:
            place = np.array([values[target.parameter(axis)] for axis in "xyz"])
            targets[target.name] = (R @ place + p).tolist()
        return replace(twin, robot=robot.with_frames(robot.base, targets))


# A session with the bar on a twin: the distances of the fixtures, then pose after pose (Nubiola, 3.5).
@dataclass(frozen=True, eq=False)
class SetUp:
    """Fixtures that stand fast, and what was measured of them."""

    base_cups: Array  #: True places of B1, B2 and B3 in the twin's world [m], ``(3, 3)``.
    base: Array  #: base, tool: measured distances 12, 23 and 31 [m], ``(3,)``.
    tool: Array


def set_up(twin: Twin, touches: Array, bar: Ballbar, approach: Array | None = None) -> SetUp:
    """Lock the base cups where the robot brings its first cup, and measure both fixtures.

    Args:
        twin: Its targets are the three cups of the tool.
        touches: Joint positions at the base cups [rad or m], ``(3, joints)``.
        bar: The ballbar; it is initialised for each fixture.
        approach: Direction of the last move of each joint, ``(3, joints)``; unknown if None.

    Raises:
        InputError: If a distance is beyond the ballbar's range.
    """
    directions = np.zeros(touches.shape) if approach is None else approach
    at_cups = [_cups(twin, joints, direction) for joints, direction in zip(touches, directions, strict=True)]
    base_cups = np.array([cups[0] for cups in at_cups])
    bar.initialise()
    base = _sides(measured_sides(bar, base_cups, "B"), "B")
    bar.initialise()
    return SetUp(base_cups, base, _sides(measured_sides(bar, at_cups[0], "T"), "T"))


def measure_poses(
    twin: Twin,
    fixtures: SetUp,
    rows: Sequence[PlannedRow],
    joints: Array,
    bar: Ballbar,
    *,
    approach: Array | None = None,
    initialise: bool = True,
    changer: ToolChanger | None = None,
) -> Array:
    """Measure one configuration after the other.

    Args:
        twin: Its targets are the three cups of the tool.
        fixtures: From :func:`set_up`.
        rows: What to measure, in order.
        joints: Joint positions to drive to [rad or m], ``(rows, joints)``; those of the rows, or corrected ones.
        bar: The ballbar.
        approach: Direction of the last move of each joint, ``(rows, joints)``; unknown if None.
        initialise: Whether the bar is put on its calibrator before every pose; else it drifts on.
        changer: If given, the tool is attached anew before every pose.

    Returns:
        cups: T1, T2 and T3 in the frame of the base fixture [m], ``(rows, 3, 3)``; NaN where a leg was beyond the
            range.
    """
    directions = np.zeros(joints.shape) if approach is None else approach
    cups = np.full((len(rows), 3, 3), np.nan)
    for number, (row, q, direction) in enumerate(zip(rows, joints, directions, strict=True)):
        if initialise:
            bar.initialise()
        attached = twin if changer is None else changer.attached(twin)
        legs = measured_legs(bar, row.design, fixtures.base_cups, _cups(attached, q, direction))
        if len(legs) == len(row.design.legs):
            lengths = np.array([legs[name] for name in row.design.leg_names])
            cups[number] = tool_cups(row.design, row.solution, fixtures.base, fixtures.tool, lengths)
    return cups


def cups_dataset(robot: Robot, labels: Sequence[str], joints: Array, cups: Array) -> Dataset:
    """Return cups ``(n, 3, 3)`` [m], measured at joint positions ``(n, joints)``, as positions of a robot's targets."""
    n = len(labels)
    return Dataset(
        source="hexapod",
        labels=tuple(labels),
        joints=joints,
        joint_kinds=tuple(joint.kind for joint in robot.joints),
        targets=tuple(target.name for target in robot.targets),
        configuration=np.repeat(np.arange(n), 3),
        target=np.tile(np.arange(3), n),
        position=cups.reshape(-1, 3),
    )


def joined(a: Dataset, b: Dataset) -> Dataset:
    """Return the positions of two sessions as one, in the frame that both have.

    A configuration of the second that is called as one of the first, ``7``, becomes ``7#2``.

    Raises:
        InputError: If their targets or joints are others, or only one of them declares deviations or the like, or one
            holds more than positions.
    """
    place = f"{a.source} and {b.source}"
    if (a.targets, a.joint_kinds) != (b.targets, b.joint_kinds):
        raise InputError("the sessions are not of one robot with one tool", where=place, cure="Name the cups alike.")
    for name in ("quaternion", "sigma_rot", "visit", "references"):
        if getattr(a, name) is not None or getattr(b, name) is not None:
            raise InputError(f"sessions with {name} cannot be joined", where=place, allowed="positions")

    def part(name: str) -> Array | None:
        first, second = getattr(a, name), getattr(b, name)
        if (first is None) != (second is None):
            raise InputError(
                f"only one of the sessions has {name}", where=place, cure="Leave it out of both, or give it in both."
            )
        return None if first is None else np.concatenate([first, second])

    return replace(
        a,
        labels=distinct_labels(a.labels + b.labels),
        joints=np.vstack([a.joints, b.joints]),
        configuration=np.concatenate([a.configuration, b.configuration + a.configurations]),
        target=np.concatenate([a.target, b.target]),
        position=np.vstack([a.position, b.position]),
        sigma=part("sigma"),
        approach=part("approach"),
        number=part("number"),
        temperature=part("temperature"),
        wrench=part("wrench"),
        simulated=a.simulated or b.simulated,
    )


def _cups(twin: Twin, q: Array, direction: Array) -> Array:
    frames = twin.postures(q[None], approach=direction[None])[0].targets
    return np.array([frames[target.name][:3, 3] for target in twin.robot.targets])


def _sides(read: dict[str, float], fixture: str) -> Array:
    names = side_names(fixture)
    for name in names:
        if name not in read:
            raise InputError(
                f"the distance {name} is beyond the range of the ballbar",
                where="fixture",
                cure="Set the cups nearer to their nominal distance.",
            )
    return np.array([read[name] for name in names])


def locked_cups(fixture: Transform, rng: np.random.Generator, off: float = 0.0, *, fourth: bool = False) -> Array:
    """Return where the cups of a base fixture truly are in the frame of the fixture's place [m], ``(3 or 4, 3)``.

    Args:
        fixture: Where it was meant to stand.
        rng: For the deviations.
        off: Standard deviation of a coordinate of a cup from its nominal place [m].
        fourth: Whether there is a fourth cup.
    """
    cups = four_cups([DEVICE.base] * 3, [DEVICE.base] * 3) if fourth else triangle([DEVICE.base] * 3, "B")
    cups = cups @ fixture.rotation.T + np.array(fixture.translation)
    return np.asarray(cups + off * rng.standard_normal(cups.shape))


def filled_sheet(
    twin: Twin,
    rows: Sequence[PlannedRow],
    base_cups: Mapping[str, Array],
    bar: Ballbar,
    changer: ToolChanger | None = None,
) -> str:
    """Return a sheet with what the bar reads on a twin; legs and distances beyond its range stay empty.

    Args:
        twin: Its targets are the three cups of the tool.
        rows: What is measured, in order. With a changer the tool is attached anew wherever the attachment is another
            than before.
        base_cups: True places of the base cups in the twin's world, by the name of the place [m], each ``(3 or 4, 3)``.
        bar: The ballbar; it is initialised before every pose.
        changer: How well the tool is attached; the same always if None.
    """
    lengths: list[dict[str, float]] = []
    attached, attachment, place = twin, rows[0].attachment, None
    for number, row in enumerate(rows):
        read: dict[str, float] = {}
        feet = base_cups[row.place]
        if changer is not None and (not number or row.attachment != attachment):
            attached, attachment = changer.attached(twin), row.attachment
        cups = np.array([attached.target_frames(row.joints)[t.name][:3, 3] for t in twin.robot.targets])
        bar.initialise()
        if not number:
            read |= measured_sides(bar, cups, "T")
        if row.place != place:
            read |= measured_sides(bar, feet[:3], "B")
            if len(feet) > 3:
                to_fourth = bar.read(np.linalg.norm(feet[:3] - feet[3], axis=1), bar.device.base).tolist()
                read |= {name: d for name, d in zip(TO_FOURTH, to_fourth, strict=True) if np.isfinite(d)}
            place = row.place
        bar.initialise()
        legs = measured_legs(bar, row.design, feet[list(SIDES_OF_FOUR[row.side - 1])], cups)
        names = dict(zip(row.design.leg_names, row.leg_names, strict=True))
        lengths.append(read | {names[name]: length for name, length in legs.items()})
    heading, *filled = sheet_csv(rows, twin.robot.joints, lengths).splitlines()
    return "\n".join([f"{heading},{SIMULATED}", *(f"{line},{YES}" for line in filled)]) + "\n"


# A fourth cup, set and measured on a twin's fixture (Nubiola, 4.5; :mod:`truearm.hexapod.sheet`).
def with_fourth(fixtures: SetUp, place: Array, bar: Ballbar) -> tuple[tuple[SetUp, Transform], ...]:
    """Measure a fourth cup on a twin's fixture.

    Args:
        fixtures: The first three cups.
        place: Where the fourth truly is in the twin's world [m], ``(3,)``.
        bar: The ballbar; it is initialised.

    Returns:
        For each side the fixture that it is, and its frame in that of the first side by the measured distances.

    Raises:
        InputError: If the fourth cup is beyond the ballbar's range from one of the others.
    """
    true = np.vstack([fixtures.base_cups, place])
    bar.initialise()
    to_fourth = bar.read(np.linalg.norm(fixtures.base_cups - place, axis=1), bar.device.base)
    for name, length in zip(TO_FOURTH, to_fourth.tolist(), strict=True):
        if not np.isfinite(length):
            raise InputError(
                f"the distance {name} is beyond the range of the ballbar",
                where="fixture",
                cure="Set the fourth cup nearer to its nominal distance.",
            )
    frames = side_frames(four_cups(fixtures.base, to_fourth))
    sides = []
    for number, (side, frame) in enumerate(zip(SIDES_OF_FOUR, frames, strict=True), 1):
        lengths = side_distances(number, fixtures.base, to_fourth)
        sides.append((SetUp(true[list(side)], lengths, fixtures.tool), frame))
    return tuple(sides)
