"""The whole of axis-by-axis calibration: circles, axes, the frames they fix, tables of parameters, joint errors.

Sources: Nubiola, sections 1.3.2 and 2.3 (base frame from axes 1 and 2, tool frame from the last two; DH parameters by
Sklar's way and the S-model by Stone's, both from lines in space); KR5 paper, sections 2.2 and 3.2 (joint errors).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np

from truearm.errors import InputError
from truearm.identification.axes.circles import AxisCircles, axis_circles
from truearm.identification.axes.fit import AxisFit, fit_axes, measured_axes
from truearm.identification.start_values.frames import initial_frames
from truearm.measurement.dataset import Dataset
from truearm.modeling.chain import Array
from truearm.modeling.conversion import converted
from truearm.modeling.lines import base_and_flange, frame_between, joint_axes
from truearm.modeling.parameters import Group
from truearm.modeling.robot import Robot
from truearm.modeling.transform import Transform, rotation_vector
from truearm.notices import Notice
from truearm.simulated import Marked, parts_of

#: Tables of parameters that are made of the axes; parallel axes leave only Hayati's.
TABLES: Final = ("standard-dh", "s-model", "hayati")
#: Axes and circles that differ by more than this many deviations are not those of a rigid arm.
_LARGEST_MISFIT: Final = 2.0


@dataclass(frozen=True, eq=False)
class AxisAnalysis:
    """What circles say about a robot."""

    nominal: Robot  #: The robot as its file has it.
    data: Dataset  #: The readings.
    found: AxisCircles  #: The circles.
    measured: AxisFit  #: The axes with all joints at zero, four numbers each.
    calibrated: AxisFit  #: The robot in its own convention.
    errors: AxisFit  #: The robot as its design with joint errors.
    in_robot_frame: bool  #: Whether the data are given in the robot's base frame; if not, axes 1 and 2 say where it is.

    @cached_property
    def robot(self) -> Robot:
        """The calibrated robot, with the targets where its own axes put them."""
        return self._with_targets(self.calibrated.robot)

    @cached_property
    def robot_with_errors(self) -> Robot:
        """The robot as its design with the joint errors found, and the targets."""
        return self._with_targets(self.errors.robot)

    def _with_targets(self, robot: Robot) -> Robot:
        position, rotation = robot.world_poses(self.data.postures)
        there = self.data.has_position
        places = {}
        for index, name in enumerate(self.data.targets):
            mine = np.flatnonzero((self.data.target == index) & there)
            at = self.data.configuration[mine]
            seen = np.einsum("nji,nj->ni", rotation[at], self.data.position[mine] - position[at])
            places[name] = seen.mean(axis=0)
        made = robot.with_frames(robot.base, places)
        kept = {n: p for n, p in robot.parameters.items() if p.group in ("geometry", "joint zero")}
        said = f"calibrated axis by axis on {len(self.found.circles)} circles of {self.data.source}"
        found = replace(made.with_parameters(kept.values()), history=(*robot.history, said), proof=None)
        return found.marked(self.data.simulated)

    @property
    def simulated_from(self) -> tuple[Marked, ...]:
        """What of it comes from a virtual instrument."""
        return parts_of((self.data, self.nominal))

    @cached_property
    def base(self) -> tuple[Transform, float, float]:
        """Where the base frame stands, and the deviations of its place [m] and of its turn [rad] at the worst."""
        return self._frame(self._base_of)

    @cached_property
    def flange(self) -> tuple[Transform, float, float]:
        """Where the flange stands with all joints at zero, by the last two axes, with the same deviations."""
        return self._frame(self._flange_of)

    def _frame(self, place: Any) -> tuple[Transform, float, float]:
        here = place(self.measured.robot)

        def moved(robot: Robot) -> Array:
            there = place(robot)
            return np.concatenate([there[:3, 3], rotation_vector(there[:3, :3] @ here[:3, :3].T)])

        _, deviation = self.measured.derived(moved)
        transform = Transform.from_matrix(here[:3, :3], here[:3, 3])
        return transform, float(deviation[:3].max()), float(deviation[3:].max())

    def _base_of(self, robot: Robot) -> Array:
        if self.in_robot_frame:
            return self._nominal_ends[0]
        axes = joint_axes(robot)
        return np.asarray(frame_between(axes[0], axes[1]) @ self._base_on_axes)

    def _flange_of(self, robot: Robot) -> Array:
        axes = joint_axes(robot)
        return np.asarray(frame_between(axes[-1], axes[-2]) @ self._flange_on_axes)

    @cached_property
    def _nominal_ends(self) -> tuple[Array, Array]:
        """Base and flange of the nominal robot in the world, ``(4, 4)`` each."""
        return base_and_flange(self.nominal)

    @cached_property
    def _base_on_axes(self) -> Array:
        """The nominal base in the frame that axes 1 and 2 fix, ``(4, 4)``."""
        axes = joint_axes(self.nominal)
        return np.asarray(np.linalg.inv(frame_between(axes[0], axes[1])) @ self._nominal_ends[0])

    @cached_property
    def _flange_on_axes(self) -> Array:
        """The nominal flange in the frame that the last two axes fix, ``(4, 4)``."""
        axes = joint_axes(self.nominal)
        return np.asarray(np.linalg.inv(frame_between(axes[-1], axes[-2])) @ self._nominal_ends[1])

    def framed(self, robot: Robot) -> Robot:
        """Return measured axes as a robot between the two frames that they fix."""
        base, flange = self._base_of(robot), self._flange_of(robot)
        R, origin = base[:3, :3], base[:3, 3]
        rows = [
            {f"axis_{a}": float(v) for a, v in zip("xyz", R.T @ axis.along, strict=True)}
            | {a: float(v) for a, v in zip("xyz", R.T @ (axis.point - origin), strict=True)}
            for axis in joint_axes(robot)
        ]
        tip = np.linalg.inv(base) @ flange
        made = replace(
            robot,
            joints=tuple(replace(joint, row=row, bearing=None) for joint, row in zip(robot.joints, rows, strict=True)),
            flange=Transform.from_matrix(tip[:3, :3], tip[:3, 3]),
            known={},
        )
        return made.with_frames(Transform.from_matrix(R, origin), {})

    def table(self, convention_name: str) -> list[dict[str, tuple[float, float]]]:
        """Return the rows of the measured axes in a convention, each number with its deviation [SI].

        Raises:
            InputError: If the convention cannot describe the axes: nearly parallel ones in a DH table or the S-model.
        """
        columns = [list(joint.row) for joint in converted(self.framed(self.measured.robot), convention_name).joints]

        def numbers(robot: Robot) -> Array:
            made = converted(self.framed(robot), convention_name)
            return np.array([j.row[c] for j, wanted in zip(made.joints, columns, strict=True) for c in wanted])

        value, deviation = self.measured.derived(numbers)
        pairs = iter(zip(value.tolist(), deviation.tolist(), strict=True))
        return [{column: next(pairs) for column in wanted} for wanted in columns]

    @property
    def notices(self) -> tuple[Notice, ...]:
        """What a person should know."""
        said = []
        if self.found.left_out:
            said.append(
                Notice(
                    "left-out",
                    f"{self.found.left_out} of {self.data.configurations} configurations belong to no run in which one"
                    " joint moves alone, and were not used.",
                )
            )
        said += [Notice("no-circle", f"A target was not used in one run. {refusal}") for refusal in self.found.refused]
        if self.found.excess > 1.0:
            said.append(
                Notice(
                    "not-circular",
                    f"The points are {self.found.excess:.2g} times further from their circles than the declared"
                    " deviations allow. The arm gives way, or something moved. All deviations are widened by that"
                    " factor.",
                )
            )
        misfit = self.calibrated.residual
        if misfit is not None and misfit > _LARGEST_MISFIT:
            said.append(
                Notice(
                    "misfit",
                    f"The convention {self.nominal.convention_name} leaves {misfit:.2g} deviations between the robot's"
                    " axes and the measured ones. If axes are parallel, convert the robot to hayati or to joint-errors."
                    " Otherwise the arm does not turn about fixed axes.",
                )
            )
        return tuple(said)


def analyse(robot: Robot, data: Dataset, *, in_robot_frame: bool = False) -> AxisAnalysis:
    """Find a robot's axes from measurements in which one joint moves at a time.

    Args:
        robot: Its current values are the nominal ones. Joint effects are kept, and deflect the axes as they say.
        data: Runs of every joint; see :func:`truearm.measurement.turns.find_runs`.
        in_robot_frame: Whether the data are given in the frame of the robot's base, as set up before (KR5 paper,
            section 3.1).

    Raises:
        InputError: If a joint has no run, slides, turns the other way or too little, or axes 1 and 2 or the last two
            are parallel.
    """
    if len(robot.joints) != data.joints.shape[1]:
        raise InputError(
            f"the data have other joints than {robot.name}",
            where=data.source,
            came=f"{data.joints.shape[1]} joints",
            allowed=f"{len(robot.joints)}",
        )
    found = axis_circles(data)
    placed = robot if in_robot_frame else robot.with_frames(initial_frames(robot, data).base, {})
    groups: tuple[Group, ...] = ("geometry",) if in_robot_frame else ("base", "geometry")
    design = converted(placed, "joint-errors")
    return AxisAnalysis(
        nominal=robot,
        data=data,
        found=found,
        measured=measured_axes(placed, found.circles),
        calibrated=fit_axes(placed, found.circles, (*groups, "joint zero")),
        errors=fit_axes(design, found.circles, groups),
        in_robot_frame=in_robot_frame,
    )
