"""A calibration table: a plate with known points, tilted by roll and pitch, that a robot's tip touches (Li 2016).

No instrument is needed. The tip is jogged onto each point and the joints are read; the reading is the known point in
the table's frame, so where the table stands and how it is tilted are base parameters of the robot that is identified.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Unpack

import numpy as np

from truearm.engine.base.errors import InputError, counted
from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY, Transform
from truearm.engine.twin.twin import Conditions, Twin, directions

#: The ball joint of the document's table turns no further about the roll axis; about the pitch axis it is free [rad].
ROLL_LIMIT: Final = math.radians(20.0)
#: On the point [m]. A twin comes to rest to 1e-13 rad.
_REACHED: Final = 1e-10
_STEPS: Final = 60
_LONGEST_STEP: Final = 0.2  # step of one joint [rad or m]: jogging, not leaping to another branch
_SINGULAR: Final = 1e-6  # share of the largest singular value below which the arm cannot move


@dataclass(frozen=True, eq=False)
class CalibrationTable:
    """A plate with known points."""

    points: Array  #: In the table's frame [m], ``(n, 3)``. Its z is the normal of the plate.
    #: ``T_world_table``: where the table truly stands in the world of the twins that touch it.
    place: Transform = IDENTITY

    def __post_init__(self) -> None:
        if self.points.ndim != 2 or self.points.shape[1] != 3 or not len(self.points):
            raise InputError(
                "a calibration table needs points of three coordinates",
                where="calibration table",
                came=f"an array of shape {self.points.shape}",
                allowed="(n, 3), n at least 1",
            )
        if not np.isfinite(self.points).all():
            raise InputError("a point on a table cannot be NaN or infinite", where="calibration table")

    @property
    def in_world(self) -> Array:
        """Where the points are in the world [m], ``(n, 3)``."""
        return np.asarray(self.points @ self.place.rotation.T + np.array(self.place.translation))

    def tilted(self, roll: float, pitch: float) -> CalibrationTable:
        """Return the table tilted about its own origin: ``T_world_table Rx(roll) Ry(pitch)``.

        Args:
            roll, pitch: [rad].

        Raises:
            InputError: If the roll is beyond what the table's ball joint turns.
        """
        if not abs(roll) <= ROLL_LIMIT:
            raise InputError(
                "the table cannot be rolled so far",
                where="roll of the calibration table",
                came=f"{math.degrees(roll):g} deg",
                allowed=f"-{math.degrees(ROLL_LIMIT):g} to {math.degrees(ROLL_LIMIT):g} deg",
            )
        (c, s), (d, t) = (math.cos(roll), math.sin(roll)), (math.cos(pitch), math.sin(pitch))
        tilt = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]) @ np.array(
            [[d, 0.0, t], [0.0, 1.0, 0.0], [-t, 0.0, d]]
        )
        turned = Transform.from_matrix(self.place.rotation @ tilt, np.array(self.place.translation))
        return replace(self, place=turned)

    def touched_by(
        self,
        twin: Twin,
        start: Sequence[float] | Array,
        noise: float,
        rng: np.random.Generator,
        source: str = "calibration table",
        **conditions: Unpack[Conditions],
    ) -> Dataset:
        """Return the joint positions at which a twin's tip is on each point, with the known points as positions.

        Args:
            twin: With one target, its tip.
            start: Joint positions from which the tip is jogged onto every point ``(joints,)`` [rad or m]: they choose
                the elbow.
            noise: Standard deviation of each coordinate of the tip about the known point [m]: play in the hole, and how
                well the points are known. Declared in the data unless it is zero.
            conditions: See :class:`~truearm.engine.twin.twin.Conditions`. If `approach` is left out, joints come from
                the point before: directions are those of the moves that an arm without hysteresis would make.

        Raises:
            InputError: Naming the first point that the tip cannot touch, or for which a joint would leave its limits;
                or if the twin has not just one target.
        """
        robot = twin.robot
        if len(robot.targets) != 1:
            raise InputError(
                "one target touches the table: the tip",
                where=robot.name,
                came=counted(len(robot.targets), "target"),
                allowed="1",
            )
        n = len(self.points)
        wanted = self.in_world + rng.normal(0.0, 1.0, (n, 3)) * noise
        q = np.tile(np.asarray(start, float), (n, 1))
        conditions.setdefault("number", np.arange(float(n)))
        if "approach" not in conditions:
            conditions["approach"] = np.zeros(q.shape)
            if any(truth.hysteresis for truth in twin.joints.values()):
                conditions["approach"] = directions(_jogged(twin, wanted, q, conditions))
        joints = _jogged(twin, wanted, q, conditions)
        _check_limits(robot, joints)
        return Dataset(
            source=source,
            labels=tuple(str(i + 1) for i in range(n)),
            joints=joints,
            joint_kinds=tuple(joint.kind for joint in robot.joints),
            targets=(robot.targets[0].name,),
            configuration=np.arange(n),
            target=np.zeros(n, dtype=np.intp),
            position=self.points,
            sigma=np.full(n, noise) if noise > 0 else None,
            approach=conditions["approach"],
            number=conditions["number"],
            temperature=conditions.get("temperature"),
            wrench=conditions.get("wrench"),
        )


def rectangular_grid(columns: int, rows: int, spacing: float) -> Array:
    """Return the points of a grid about the origin of the plane z = 0, row by row along x [m], ``(columns*rows, 3)``.

    Raises:
        InputError: If there is no point, or no space between them.
    """
    if columns < 1 or rows < 1 or not 0.0 < spacing < math.inf:
        raise InputError(
            "a grid needs columns, rows and space between them",
            where="grid of the calibration table",
            came=f"{columns} x {rows}, {spacing * 1e3:g} mm apart",
        )
    x, y = np.meshgrid(np.arange(columns) - (columns - 1) / 2, np.arange(rows) - (rows - 1) / 2)
    return np.stack([x.ravel(), y.ravel(), np.zeros(columns * rows)], axis=1) * spacing


def _jogged(twin: Twin, wanted: Array, start: Array, conditions: Conditions) -> Array:
    """Return joints ``(n, joints)`` with the tip where it is wanted ``(n, 3)`` [m], by least-norm Newton steps.

    The Jacobian is that of the arm without its joints' imperfections: steps need not be exact, their end is. Most of
    the way that arm is followed too, since all its configurations are computed at once.
    """
    name, q = twin.robot.targets[0].name, start
    for imperfect in (False, True):
        for _ in range(_STEPS):
            if imperfect:
                tip = np.array([posture.targets[name][:3, 3] for posture in twin.postures(q, **conditions)])
            else:
                tip = twin.robot.world_poses(q, name)[0]
            missing = wanted - tip
            apart = np.linalg.norm(missing, axis=1)
            if (apart < _REACHED).all():
                if imperfect:
                    return q
                break
            jacobian = twin.robot.joint_jacobian(q, name)[:, :3]
            step = (np.linalg.pinv(jacobian, rcond=_SINGULAR) @ missing[:, :, None])[:, :, 0]
            longest = np.abs(step).max(axis=1, keepdims=True)
            q = q + step * np.minimum(1.0, _LONGEST_STEP / np.maximum(longest, _LONGEST_STEP))
    worst = int(np.argmax(apart >= _REACHED))
    raise InputError(
        "the tip does not come to rest on a point of the table",
        where=f"calibration table, point {worst + 1}",
        came=f"a tip that stays {apart[worst] * 1e3:.3g} mm away",
        cure="It may be out of reach: move the table, tilt it less, or start from another posture.",
    )


def _check_limits(robot: Robot, joints: Array) -> None:
    for i, row in enumerate(joints):
        for joint, position in zip(robot.joints, row.tolist(), strict=True):
            if joint.limits is None or joint.limits[0] <= position <= joint.limits[1]:
                continue
            scale, unit = (180 / math.pi, "deg") if joint.kind == "revolute" else (1e3, "mm")
            raise InputError(
                "a joint would leave its limits to touch a point",
                where=f"calibration table, point {i + 1}",
                came=f"{joint.name} at {position * scale:.4g} {unit}",
                allowed=f"{joint.limits[0] * scale:g} to {joint.limits[1] * scale:g} {unit}",
                cure="Move the table, tilt it less, or start from another posture.",
            )
