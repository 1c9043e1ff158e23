"""What was found in a recording: speeds of the joints, the standstills, and the targets in them."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING, Final

import numpy as np

from truearm.engine.document.document import Document, Section, answer, pictured, tabled
from truearm.engine.document.drawing import HUES, Panel, line, panels, significant

if TYPE_CHECKING:
    from truearm.bags.result import ImportedBag
    from truearm.bags.standstills import Recording
    from truearm.engine.document.drawing import Figure
    from truearm.engine.robot.chain import Array

_BAND: Final = "#c3d5e3"
_MOST: Final = 3000


def bag_html(imported: ImportedBag) -> str:
    """Return the page."""
    recording = imported.found
    words = (
        "In the blue times the robot stands still: no joint moves more than allowed. The mean of what was seen of a "
        "target then is its reading. Where a target moves in them, the clocks of the two topics differ."
    )
    drawing = pictured("recording", "Joints and targets over time", words, _picture(recording))
    return Document(
        "Standstills in a recording",
        [
            answer(imported.lines(), ()),
            _table(recording),
            drawing,
        ],
        imported.command,
        subtitle=imported.data.source,
    ).html(imported)


def _picture(recording: Recording) -> Figure:
    shapes = [
        {
            "type": "rect",
            "yref": "paper",
            "x0": round(still.start, 4),
            "x1": round(still.end, 4),
            "y0": 0,
            "y1": 1,
            "fillcolor": _BAND,
            "line": {"width": 0},
            "layer": "below",
        }
        for still in recording.standstills
    ]
    stream = recording.joints
    prismatic = np.array([kind == "prismatic" for kind in recording.data.joint_kinds])
    shown = np.where(prismatic, 1e3 * stream.positions, np.degrees(stream.positions))
    moves = [
        line(name, stream.times[chosen], shown[chosen, joint] - shown[0, joint], HUES[joint % len(HUES)], 1.2)
        for chosen in (_thin(len(stream.times)),)
        for joint, name in enumerate(stream.names)
    ]
    unit = "[deg or mm]" if prismatic.any() else "[deg]"
    title = f"Joints ({html.escape(stream.topic)}), from their first positions"
    drawn = [Panel(title, moves, "time [s]", unit, shapes=shapes)]
    for target in recording.targets:
        rows = _thin(len(target.times))
        away: Array = np.linalg.norm(target.positions - target.positions[0], axis=1) * 1e3
        drawn.append(
            Panel(
                f"{html.escape(target.target)} ({html.escape(target.topic)}), from where it was first",
                [line("", target.times[rows], away[rows], HUES[0], 1.2)],
                "time [s]",
                "distance [mm]",
                shapes=shapes,
            )
        )
    return panels(drawn, 1, 240)


def _thin(count: int) -> Array:
    return np.unique(np.linspace(0, count - 1, min(count, _MOST)).round().astype(np.intp))


def _table(recording: Recording) -> Section:
    heading = (
        "configuration",
        "from [s]",
        "to [s]",
        "target",
        "samples",
        "set aside",
        "scatter [mm]",
        "deviation [mm]",
    )
    rows = [
        (
            recording.data.labels[number - 1],
            f"{still.start:.2f}",
            f"{still.end:.2f}",
            target.target,
            str(row[number - 1].samples),
            str(row[number - 1].set_aside),
            *(
                significant(1e3 * value, 2) if np.isfinite(value) else "not seen"
                for value in (row[number - 1].scatter, row[number - 1].sigma)
            ),
        )
        for number, still in enumerate(recording.standstills, 1)
        for target, row in zip(recording.targets, recording.sightings, strict=True)
    ]
    return tabled("Standstills", heading, tuple(rows))
