"""Several sheets as one: those of one robot with one tool, with the base fixture at one place or several."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.measurement.dataset_fields import distinct_labels
from truearm.measurement.hexapod.four_cups import TO_FOURTH
from truearm.measurement.hexapod.geometry import side_names
from truearm.measurement.hexapod.sheet import Sheet
from truearm.measurement.readers.rows import Configurations

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


def _refuse_others(one: Sheet, other: Sheet) -> None:
    where = f"{one.source} and {other.source}"
    if one.configurations is not None and other.configurations is not None:
        kinds = [sheet.configurations.kinds for sheet in (one, other) if sheet.configurations is not None]
        if kinds[0] != kinds[1]:
            raise InputError(
                "the sheets are not of one robot",
                where=where,
                came=f"joints {', '.join(kinds[0])}, and {', '.join(kinds[1])}",
                cure="Solve the sheets of each robot on their own.",
            )
        if one.configurations.joints_are != other.configurations.joints_are:
            raise InputError(
                "one of the sheets has joint_1 .., the other axis_1 ..",
                where=where,
                cure="Plan both alike: joint positions of the model, or those that the controller shows.",
            )
    elif one.configurations is not other.configurations:
        raise InputError("only one of the sheets has joint positions", where=where, cure="Add them.")
    for name, mine, its in zip(side_names("T"), one.tool[-1], other.tool[0], strict=True):
        if abs(mine - its) > _SAME_FIXTURE:
            raise InputError(
                "the sheets are not of one tool",
                where=where,
                came=f"{name} {mine * 1e3:.4f} and {its * 1e3:.4f} mm",
                allowed=f"distances between its cups that differ by {_SAME_FIXTURE * 1e3:g} mm at most",
                cure="Solve the sheets of each tool on their own. If the tool is the same, measure its cups again.",
            )
    for what, values in (
        ("places", (one.places, other.places)),
        ("attachments", (one.attachments, other.attachments)),
    ):
        if (values[0] is None) != (values[1] is None):
            raise InputError(
                f"only one of the sheets names its {what}",
                where=where,
                allowed=f"a column {what[:-1]} that is filled in in all sheets, or in none",
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
        given = lengths[np.isfinite(lengths)]
        if len(given) and np.ptp(given) > _SAME_FIXTURE:
            raise InputError(
                f"the base fixture did not stand still at the place {place}",
                where=sheet.source,
                came=f"{name} from {given.min() * 1e3:.4f} to {given.max() * 1e3:.4f} mm",
                allowed=f"distances that differ by {_SAME_FIXTURE * 1e3:g} mm at most",
                cure="A fixture that was set up anew stands at another place: give it another name.",
            )
