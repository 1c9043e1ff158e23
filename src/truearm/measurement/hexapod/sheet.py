"""The sheet: one row a configuration, with the cups and the lengths between them. A plan prints it, a person fills it.

Columns ``configuration``, ``design`` (``112212331``), ``solution`` (1 to 4), ``joint_1 [deg]`` .. (or ``axis_1 [deg]``
.., as the controller shows them) and fifteen lengths:
``B1-B2 [mm]``, ``T1-T2 [mm]`` and so on between cups of a fixture, ``B1-T1 [mm]`` to ``B3-T3 [mm]`` for legs. Legs that
the design does not have stay empty. A row of which a leg could not be measured stays as well, and is left out. The
fixtures' distances must be in the first row; where a later row leaves one empty, the one above holds.

Three columns more say what was changed between rows. ``place``: where the base fixture stood; the rows of a place stand
together, and its base distances in the first of them. ``side``, 1 to 4: on which side of four cups; then there are the
distances ``B1-B4 [mm]`` .. and the legs ``B4-T1 [mm]`` .. as well. ``attachment``: which attachment of the tool, by any
text, where a tool changer lets go of it.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.measurement.dataset import Dataset, IntArray
from truearm.measurement.hexapod.attachments import Attachments, compared
from truearm.measurement.hexapod.four_cups import TO_FOURTH, four_cups, legs_of_side, side_distances, side_frames
from truearm.measurement.hexapod.geometry import DEVICE, Design, side_names
from truearm.measurement.hexapod.kinematics import tool_cups
from truearm.measurement.readers.rows import Configurations
from truearm.modeling.chain import Array
from truearm.modeling.controller import Controller
from truearm.modeling.formats.joint_columns import joint_cells, joint_headings
from truearm.modeling.parts import Joint
from truearm.units import written

#: Distances within the fixtures, and legs, of three base cups; and what a fourth cup adds to each.
FIXTURES: Final = (*side_names("B"), *side_names("T"))
LEGS: Final = tuple(f"B{base}-T{tool}" for base in (1, 2, 3) for tool in (1, 2, 3))
FOURTH_LEGS: Final = tuple(f"B4-T{tool}" for tool in (1, 2, 3))
#: Deviation of a coordinate of a cup, in deviations of a length: the root mean square over Nubiola's Table 3.1, worked
#: out anew, is 1.6, and nine coordinates of a pose weigh no more than its six lengths.
CUP_DEVIATION: Final = 2.0


@dataclass(frozen=True, eq=False)
class Sheet:
    """Lengths measured with the device."""

    source: str  #: The file, for messages.
    configurations: Configurations | None  #: Labels and joint positions, one row each; None if the sheet has no joints.
    labels: tuple[str, ...]  #: One for each row.
    designs: tuple[Design, ...]  #: designs, solutions: of each row.
    solutions: tuple[int, ...]
    base: Array  #: base, tool: distances 12, 23 and 31 of the fixtures [m], ``(rows, 3)``.
    tool: Array
    legs: Array  #: In the order of the design's legs [m], ``(rows, 6)``; NaN where one could not be measured.
    #: Name of the place of the base fixture of each row; None if the sheet does not name it.
    places: tuple[str, ...] | None
    sides: tuple[int, ...]  #: Side of four cups of each row, 1 to 4; 1 is that of three cups.
    to_fourth: Array  #: Distances 14, 24 and 34 [m], ``(rows, 3)``; NaN without a fourth cup.
    #: Attachment of the tool of each row, empty in rows that were not measured; None if the sheet does not say.
    attachments: tuple[str, ...] | None

    @property
    def measured(self) -> IntArray:
        """Indices of the rows with all six legs."""
        return np.flatnonzero(np.isfinite(self.legs).all(axis=1))

    def cups(self) -> Array:
        """Return T1, T2 and T3 in the frame of the base fixture where it stood [m], ``(rows, 3, 3)``.

        That is the frame of its first three cups, whatever the side. NaN where a leg is missing.
        """
        found = np.full((len(self.labels), 3, 3), np.nan)
        for row in self.measured.tolist():
            side, base = self.sides[row], self.base[row]
            if side > 1:
                base = side_distances(side, base, self.to_fourth[row])
            seen = tool_cups(self.designs[row], self.solutions[row], base, self.tool[row], self.legs[row])
            if side > 1:
                frame = side_frames(four_cups(self.base[row], self.to_fourth[row]))[side - 1]
                seen = seen @ frame.rotation.T + np.array(frame.translation)
            found[row] = seen
        return found

    def attached(self) -> Attachments | None:
        """Return how well the tool changer repeats the cups; None if the tool was attached once, as far as is said."""
        rows = self.measured
        if self.attachments is None or self.configurations is None:
            return None
        names = [self.attachments[row] for row in rows]
        if len(set(names)) < 2:
            return None
        places = [self.places[row] if self.places else "" for row in rows]
        return compared(self.cups()[rows], self.configurations.joints[rows], places, names)

    def dataset(self, targets: Sequence[str] = ("1", "2", "3")) -> Dataset:
        """Return the measured rows as positions of the three cups.

        They are in the frame of the base fixture, or, if it stood at several places, counted from a fixture named as
        the place is, for each. They declare no deviations, because what a robot does not repeat is many times what the
        ballbar does not know; but if the tool was attached several times and rows say how well, they declare that.

        Raises:
            InputError: If the sheet has no joints, or no row with all six legs.
        """
        if self.configurations is None:
            raise InputError(
                "the sheet has no joint positions",
                where=self.source,
                allowed="joint_1 [deg] .., or axis_1 [deg] ..",
                cure="Add them.",
            )
        rows = self.measured
        if not len(rows):
            raise InputError("no row has all six legs", where=self.source, cure="Fill in the lengths.")
        fixtures = tuple(dict.fromkeys(self.places[row] for row in rows)) if self.places else ()
        several = self.places is not None and len(fixtures) > 1
        attached = self.attached()
        sigma = None
        if attached is not None and attached.found is not None and self.attachments is not None:
            found = attached.found.declared([self.attachments[row] for row in rows])
            sigma = np.maximum(found, CUP_DEVIATION * DEVICE.sigma).reshape(-1)
        return Dataset(
            source=self.source,
            labels=tuple(self.labels[row] for row in rows),
            joints=self.configurations.joints[rows],
            joint_kinds=self.configurations.kinds,
            joints_are=self.configurations.joints_are,
            targets=tuple(targets),
            configuration=np.repeat(np.arange(len(rows)), 3),
            target=np.tile(np.arange(3), len(rows)),
            position=self.cups()[rows].reshape(-1, 3),
            fixtures=fixtures if several else (),
            fixture=np.repeat([fixtures.index(self.places[row]) for row in rows], 3)
            if several and self.places is not None
            else None,
            sigma=sigma,
            simulated=self.configurations.simulated,
        )


@dataclass(frozen=True, eq=False)
class PlannedRow:
    """One configuration to measure."""

    configuration: str  #: configuration, branch: what it is called, and the posture of the arm.
    branch: str
    pose: int  #: Number of the pose.
    design: Design  #: design, solution: which legs, and how they are assembled.
    solution: int
    joints: Array  #: Joint positions [rad or m], ``(joints,)``.
    place: str = ""  #: Name of the place of the base fixture; empty if there is one place only.
    side: int = 1  #: Of four cups, 1 to 4; 1 is that of three cups.
    attachment: str = ""  #: Which attachment of the tool; empty if it stays on.

    @property
    def leg_names(self) -> tuple[str, ...]:
        """The six legs as ``B4-T2``, in the order of the design."""
        return legs_of_side(self.design, self.side)


def sheet_csv(
    rows: Sequence[PlannedRow],
    joints: Sequence[Joint],
    lengths: Sequence[dict[str, float]] = (),
    controller: Controller | None = None,
) -> str:
    """Return a sheet, empty or with lengths.

    Args:
        rows: What to measure, in order.
        joints: Of the robot.
        lengths: For each row the lengths [m] by name; what is not there stays empty.
        controller: Who shows the joint positions, ``axis_i``; None for the model's, ``joint_i``.
    """
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    positions = joint_cells(np.array([row.joints for row in rows]).reshape(-1, len(joints)), joints, controller)
    with_places, with_sides = any(row.place for row in rows), any(row.side > 1 for row in rows)
    names = [*FIXTURES, *(TO_FOURTH if with_sides else ()), *LEGS, *(FOURTH_LEGS if with_sides else ())]
    plain = ["configuration", *(["place"] if with_places else []), "pose", "branch"]
    plain += [*(["side"] if with_sides else []), "design", "solution", "attachment"]
    writer.writerow([*plain, *joint_headings(joints, controller), *(f"{name} [mm]" for name in names)])
    for number, row in enumerate(rows):
        known = lengths[number] if lengths else {}
        cells = (repr(written(known[name], "mm")) if name in known else "" for name in names)
        said = {"configuration": row.configuration, "place": row.place, "pose": row.pose, "branch": row.branch}
        said |= {"side": row.side, "design": row.design.name, "solution": row.solution, "attachment": row.attachment}
        writer.writerow([*(said[name] for name in plain), *positions[number], *cells])
    return stream.getvalue()
