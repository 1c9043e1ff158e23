"""The sheet of a campaign with the hexapod device, its fourth cup and attachments, and several sheets as one."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.base.units import written
from truearm.engine.data.dataset import Dataset, IntArray
from truearm.engine.data.dataset_fields import distinct_labels
from truearm.engine.data.hexapod import DEVICE, SIDES, Design, Order, side_names, tool_cups, triangle, tripod
from truearm.engine.data.readers.rows import Configurations
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import Controller
from truearm.engine.robot.parts import Joint
from truearm.engine.robot.transform import Transform
from truearm.engine.robot.urdf_writing import joint_cells, joint_headings
from truearm.hexapod.places import plain_frame

# How well a tool changer repeats the cups: configurations measured again after the tool was attached anew.
#
# A tool that is attached anew is shifted and turned on the flange by a little, the same in the frame of the tool
# wherever the robot stands. What moved between two attachments is therefore counted in the frame of the cups. Each
# displacement is the sum of what is of its configuration, what is of its attachment, and the rest, which is of the
# robot's repeatability and of the ballbar. How much of the variance is of the attachments follows from sums of squares
# with and without them (Henderson 1953, method 3), so that configurations need not all be measured equally often.

#: Joint positions nearer than this are those of one configuration [rad or m].
_SAME: Final = 1e-6


@dataclass(frozen=True, eq=False)
class ChangerRepeatability:
    """What was found of a tool changer, for the cups T1, T2 and T3."""

    changer: Array  #: Standard deviation of a coordinate that is due to the attachment [m], ``(3,)``.
    #: The same of what does not repeat though the tool stays on, robot and ballbar together [m], ``(3,)``; None if
    #: nothing tells it: it is contained in `changer` then.
    rest: Array | None
    mean: Array  #: mean, largest: distance between where a cup is with two attachments, over all pairs [m], ``(3,)``.
    largest: Array
    pairs: int  #: How many pairs of readings of one configuration with two attachments there are.
    compared: int  #: How many attachments are in them.

    def declared(self, attachments: Sequence[str]) -> Array:
        """Return the standard deviation of a coordinate of each cup in each row [m], ``(rows, 3)``.

        What an attachment moves is the same in all its rows, and the place of the tool is found from all rows. So it
        counts as it differs from the mean over the rows: by nothing where there is one attachment only, in full where
        each row has its own. With the shares ``w`` of the attachments in the rows, the variance of an attachment ``a``
        less that mean is ``1 - 2 w_a + sum(w ** 2)`` times that of the changer. Where the rest is not known it is
        contained in `changer`, which then counts in full.

        Args:
            attachments: Of each row.
        """
        if self.rest is None:
            return np.tile(self.changer, (len(attachments), 1))
        rows = np.array(attachments)
        _, of_row, counts = np.unique(rows, return_inverse=True, return_counts=True)
        share = counts / len(rows)
        part = np.maximum(1.0 - 2.0 * share + (share**2).sum(), 0.0)[of_row]
        return np.asarray(np.sqrt(self.rest**2 + part[:, None] * self.changer**2))


@dataclass(frozen=True, eq=False)
class Attachments:
    """The attachments of the tool in a sheet, two or more."""

    count: int  #: How many there were.
    repeatability: (
        ChangerRepeatability | None
    )  #: How well they repeat; None if no configuration was measured with two of them.


def compared(cups: Array, joints: Array, places: Sequence[str], attachments: Sequence[str]) -> Attachments:
    """Compare the attachments of a tool.

    Args:
        cups: T1, T2 and T3 of each row in the frame of the fixture [m], ``(rows, 3, 3)``.
        joints: Joint positions [rad or m], ``(rows, joints)``; where they are the same, the configuration is.
        places: Where the fixture stood at each row: only readings of one place are compared.
        attachments: Of each row, two different ones or more.
    """
    groups: dict[tuple[object, ...], list[int]] = {}
    for row, place in enumerate(places):
        key = (place, *np.round(joints[row] / _SAME).astype(int).tolist())
        groups.setdefault(key, []).append(row)
    again = [rows for rows in groups.values() if len({attachments[row] for row in rows}) > 1]
    count = len(set(attachments))
    if not again:
        return Attachments(count, None)
    of_pairs = len({attachments[row] for rows in again for row in rows})
    # Readings of one configuration with the same attachment say what else does not repeat.
    again += [rows for rows in groups.values() if len(rows) > 1 and len({attachments[row] for row in rows}) == 1]
    moved = np.concatenate([(cups[r] - cups[r[0]]) @ plain_frame(cups[r[0]]).rotation for r in again])
    names = [attachments[row] for rows in again for row in rows]
    known = sorted(set(names))
    of_configuration = np.repeat(np.eye(len(again)), [len(rows) for rows in again], axis=0)
    of_attachment = np.array([[name == attachment for attachment in known] for name in names], float)
    both = np.hstack([of_configuration, of_attachment])
    apart = of_attachment - of_configuration @ np.linalg.lstsq(of_configuration, of_attachment, rcond=None)[0]
    without, left = _left(of_configuration, moved), _left(both, moved)
    freedom = int(np.linalg.matrix_rank(both)) - len(again)
    free = len(moved) - len(again) - freedom
    unexplained = left / free if free else np.zeros(3)
    changer = np.sqrt(np.maximum(without - left - freedom * unexplained, 0.0) / (apart**2).sum())
    distances = np.array(
        [
            np.linalg.norm(cups[a] - cups[b], axis=1)
            for rows in again
            for a, b in combinations(rows, 2)
            if attachments[a] != attachments[b]
        ]
    )
    return Attachments(
        count,
        ChangerRepeatability(
            changer=changer,
            rest=np.sqrt(unexplained) if free else None,
            mean=distances.mean(axis=0),
            largest=distances.max(axis=0),
            pairs=len(distances),
            compared=of_pairs,
        ),
    )


def _left(columns: Array, moved: Array) -> Array:
    """Return the variance of a coordinate of each cup times its degrees of freedom that columns leave, ``(3,)``."""
    flat = moved.reshape(len(moved), -1)
    residual = flat - columns @ np.linalg.lstsq(columns, flat, rcond=None)[0]
    return np.asarray((residual.reshape(moved.shape) ** 2).sum(axis=(0, 2)) / 3.0)


# A fourth cup on the base fixture, 300 mm from the three others (Nubiola, 4.5).
#
# The four cups are the corners of a tetrahedron, and the tool can be measured outside each of its four sides. The
# fourth cup stands below the first three, so that the first side is the fixture as it was. Six distances between the
# cups say where the sides are to each other, as well as the bar reads: unlike a fixture that is moved, they need no
# robot.

#: The cups of each side, counted from 0, in the order in which they are its B1, B2 and B3: from outside, they go round
#: against the clock.
SIDES_OF_FOUR: Final[tuple[Order, ...]] = ((0, 1, 2), (1, 0, 3), (2, 1, 3), (0, 2, 3))
#: Names of the distances to the fourth cup.
TO_FOURTH: Final = ("B1-B4", "B2-B4", "B3-B4")


def four_cups(base: Sequence[float] | Array, to_fourth: Sequence[float] | Array) -> Array:
    """Return B1 to B4 in the frame of the first three [m], ``(4, 3)``.

    Args:
        base: Distances 12, 23 and 31 [m], ``(3,)``.
        to_fourth: Distances 14, 24 and 34 [m], ``(3,)``.

    Raises:
        InputError: If the first three lie on one line, or the distances do not meet.
    """
    cups = triangle(base, "B")
    return np.vstack([cups, tripod(cups, np.asarray(to_fourth, float), -1, TO_FOURTH)])


def side_frames(cups: Array) -> tuple[Transform, ...]:
    """Return the frame of each side in that of the cups ``(4, 3)`` [m], as :data:`SIDES_OF_FOUR` orders them."""
    return tuple(plain_frame(cups[list(side)]) for side in SIDES_OF_FOUR)


def side_distances(side: int, base: Sequence[float] | Array, to_fourth: Sequence[float] | Array) -> Array:
    """Return the distances 12, 23 and 31 of a side, 1 to 4 [m], ``(3,)``; the rest as in :func:`four_cups`."""
    between = dict(zip((frozenset(ends) for ends in SIDES), np.asarray(base, float), strict=True))
    between |= {frozenset((cup, 3)): length for cup, length in enumerate(np.asarray(to_fourth, float))}
    cups = SIDES_OF_FOUR[side - 1]
    return np.array([between[frozenset((cups[a], cups[b]))] for a, b in SIDES])


def legs_of_side(design: Design, side: int) -> tuple[str, ...]:
    """Return the legs of a design on a side, 1 to 4, by the names of the cups, as ``B4-T2``; in the design's order."""
    cups = SIDES_OF_FOUR[side - 1]
    return tuple(f"B{cups[base] + 1}-T{tool + 1}" for base, tool in design.legs)


# The sheet: one row a configuration, with the cups and the lengths between them. A plan prints it, a person fills it.
#
# Columns ``configuration``, ``design`` (``112212331``), ``solution`` (1 to 4), ``joint_1 [deg]`` .. (or ``axis_1
# [deg]`` .., as the controller shows them) and fifteen lengths: ``B1-B2 [mm]``, ``T1-T2 [mm]`` and so on between cups
# of a fixture, ``B1-T1 [mm]`` to ``B3-T3 [mm]`` for legs. Legs that the design does not have stay empty. A row of which
# a leg could not be measured stays as well, and is left out. The fixtures' distances must be in the first row; where a
# later row leaves one empty, the one above holds.
#
# Three columns more say what was changed between rows. ``place``: where the base fixture stood; the rows of a place
# stand together, and its base distances in the first of them. ``side``, 1 to 4: on which side of four cups; then there
# are the distances ``B1-B4 [mm]`` .. and the legs ``B4-T1 [mm]`` .. as well. ``attachment``: which attachment of the
# tool, by any text, where a tool changer lets go of it.

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
        cups = np.full((len(self.labels), 3, 3), np.nan)
        for row in self.measured.tolist():
            side, base = self.sides[row], self.base[row]
            if side > 1:
                base = side_distances(side, base, self.to_fourth[row])
            seen = tool_cups(self.designs[row], self.solutions[row], base, self.tool[row], self.legs[row])
            if side > 1:
                frame = side_frames(four_cups(self.base[row], self.to_fourth[row]))[side - 1]
                seen = seen @ frame.rotation.T + np.array(frame.translation)
            cups[row] = seen
        return cups

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
        if attached is not None and attached.repeatability is not None and self.attachments is not None:
            deviations = attached.repeatability.declared([self.attachments[row] for row in rows])
            sigma = np.maximum(deviations, CUP_DEVIATION * DEVICE.sigma).reshape(-1)
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
        texts = {"configuration": row.configuration, "place": row.place, "pose": row.pose, "branch": row.branch}
        texts |= {"side": row.side, "design": row.design.name, "solution": row.solution, "attachment": row.attachment}
        writer.writerow([*(texts[name] for name in plain), *positions[number], *cells])
    return stream.getvalue()


#: Distances of one fixture differ by less than this from one sheet to the next [m]: 300 mm of steel grow by 0.035 mm in
#: 10 K, of aluminium by 0.07 mm.
_SAME_FIXTURE: Final = 0.1e-3
#: Rows that say where each of several places is, as for any fixture that is measured against.
_LEAST_ROWS: Final = 4


def together(sheets: Sequence[Sheet]) -> Sheet:
    """Return sheets as one.

    Sheets whose places have names share those that have the same name. A sheet that names none is a place of its own,
    called ``fixture_1`` and so on, if there are several.

    Raises:
        InputError: If they are not of one robot and one tool, only some of them name places or attachments, or a place
            has too few rows with all legs, or base distances that cannot be those of a fixture that stands still.
    """
    first, *others = sheets
    for other in others:
        _refuse_others(first, other)
    if others:
        places = [
            place
            for number, sheet in enumerate(sheets, 1)
            for place in (sheet.places or (f"fixture_{number}",) * len(sheet.labels))
        ]
        labels = distinct_labels([label for sheet in sheets for label in sheet.labels])
        attachments = [a for sheet in sheets for a in sheet.attachments or ()]
        joined = replace(
            first,
            source=", ".join(sheet.source for sheet in sheets),
            configurations=_configurations(sheets, labels),
            labels=labels,
            designs=tuple(design for sheet in sheets for design in sheet.designs),
            solutions=tuple(solution for sheet in sheets for solution in sheet.solutions),
            base=np.vstack([sheet.base for sheet in sheets]),
            tool=np.vstack([sheet.tool for sheet in sheets]),
            legs=np.vstack([sheet.legs for sheet in sheets]),
            places=tuple(places),
            sides=tuple(side for sheet in sheets for side in sheet.sides),
            to_fourth=np.vstack([sheet.to_fourth for sheet in sheets]),
            attachments=tuple(attachments) if first.attachments is not None else None,
        )
    else:
        joined = first
    if joined.places is not None:
        for place in dict.fromkeys(joined.places):
            _refuse_moved(joined, place)
    return joined


def _refuse_others(first: Sheet, second: Sheet) -> None:
    place = f"{first.source} and {second.source}"
    if first.configurations is not None and second.configurations is not None:
        kinds = [sheet.configurations.kinds for sheet in (first, second) if sheet.configurations is not None]
        if kinds[0] != kinds[1]:
            raise InputError(
                "the sheets are not of one robot",
                where=place,
                came=f"joints {', '.join(kinds[0])}, and {', '.join(kinds[1])}",
                cure="Solve the sheets of each robot on their own.",
            )
        if first.configurations.joints_are != second.configurations.joints_are:
            raise InputError(
                "one of the sheets has joint_1 .., the other axis_1 ..",
                where=place,
                cure="Plan both alike: joint positions of the model, or those that the controller shows.",
            )
    elif first.configurations is not second.configurations:
        raise InputError("only one of the sheets has joint positions", where=place, cure="Add them.")
    for name, length, other_length in zip(side_names("T"), first.tool[-1], second.tool[0], strict=True):
        if abs(length - other_length) > _SAME_FIXTURE:
            raise InputError(
                "the sheets are not of one tool",
                where=place,
                came=f"{name} {length * 1e3:.4f} and {other_length * 1e3:.4f} mm",
                allowed=f"distances between its cups that differ by {_SAME_FIXTURE * 1e3:g} mm at most",
                cure="Solve the sheets of each tool on their own. If the tool is the same, measure its cups again.",
            )
    for kind, values in (
        ("places", (first.places, second.places)),
        ("attachments", (first.attachments, second.attachments)),
    ):
        if (values[0] is None) != (values[1] is None):
            raise InputError(
                f"only one of the sheets names its {kind}",
                where=place,
                allowed=f"a column {kind[:-1]} that is filled in in all sheets, or in none",
                cure="Fill it in in all of them, the same name for the same.",
            )


def _configurations(sheets: Sequence[Sheet], labels: tuple[str, ...]) -> Configurations | None:
    parts = [sheet.configurations for sheet in sheets if sheet.configurations is not None]
    if not parts:
        return None
    joints = np.vstack([part.joints for part in parts])
    simulated = any(part.simulated for part in parts)
    rows = np.arange(len(labels))
    return Configurations(labels, joints, parts[0].kinds, rows, parts[0].joints_are, simulated=simulated)


def _refuse_moved(sheet: Sheet, place: str) -> None:
    """Refuse a place where too little was measured, or whose fixture cannot have stood still."""
    rows = [row for row, name in enumerate(sheet.places or ()) if name == place]
    measured = int(np.isfinite(sheet.legs[rows]).all(axis=1).sum())
    least = _LEAST_ROWS if len(set(sheet.places or ())) > 1 else 1
    if measured < least:
        raise InputError(
            f"too few rows of the place {place} have all six legs",
            where=sheet.source,
            came=measured,
            allowed=f"{least} or more",
            cure="Fill in the lengths, or remove the rows of this place.",
        )
    between = np.hstack([sheet.base[rows], sheet.to_fourth[rows]])
    for name, lengths in zip((*side_names("B"), *TO_FOURTH), between.T, strict=True):
        known_lengths = lengths[np.isfinite(lengths)]
        if len(known_lengths) and np.ptp(known_lengths) > _SAME_FIXTURE:
            raise InputError(
                f"the base fixture did not stand still at the place {place}",
                where=sheet.source,
                came=f"{name} from {known_lengths.min() * 1e3:.4f} to {known_lengths.max() * 1e3:.4f} mm",
                allowed=f"distances that differ by {_SAME_FIXTURE * 1e3:g} mm at most",
                cure="A fixture that was set up anew stands at another place: give it another name.",
            )
