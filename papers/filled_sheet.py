"""A planned sheet filled in on a twin: to rehearse a campaign before the bar is taken in hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from papers.simulated import Ballbar, measured_legs, measured_sides
from papers.tool_changer import ToolChanger
from truearm.engine.base.units import COLUMN as SIMULATED
from truearm.engine.base.units import YES
from truearm.engine.data.hexapod import DEVICE, triangle
from truearm.engine.robot.chain import Array
from truearm.engine.robot.transform import Transform
from truearm.engine.twin.twin import Twin
from truearm.hexapod.sheet import SIDES_OF_FOUR, TO_FOURTH, PlannedRow, four_cups, sheet_csv


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
