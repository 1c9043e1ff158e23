"""What inclinometers told of the joints, and what that does to the errors of poses: one HTML file."""

from __future__ import annotations

import html
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from truearm.engine.document.document import (
    Block,
    Cell,
    Document,
    Facts,
    Lead,
    Picture,
    Section,
    Table,
    Words,
    pictured,
    warned,
)
from truearm.engine.document.drawing import (
    AFTER,
    BEFORE,
    Figure,
    axis,
    deserved,
    figure,
    logarithmic_axis,
    rounded,
    significant,
)

if TYPE_CHECKING:
    from truearm.engine.data.statistics import Errors
    from truearm.inclinometers.tilting import Tilting

_COLOURS = {"clearance": "#3b7d3b", "backlash": AFTER, "compliance": "#8a6d1d"}
_WORDS = {
    "clearance": "tilt in the bearings, from the middle",
    "backlash": "backlash, the whole play",
    "compliance": "compliance about the axis",
}


def tilting_html(tilting: Tilting) -> str:
    """Return the report of both stages."""
    source, rows = Path(tilting.read.source).name, tilting.constants()
    geometry = tilting.geometry
    with_geometry = "" if geometry is None else f", {Path(geometry.data.source.replace(chr(92), '/')).name}"
    pushed = f"; {tilting.pushed} configurations of poses under loads" if tilting.pushed else ""
    facts = [
        ("Robot", f"{tilting.robot.title} (`{tilting.robot.name}`)"),
        *((name.capitalize(), text) for name, text in tilting.notes.items()),
        ("Inclinometers", "; ".join(tilting.read.instruments.names)),
        (
            "Compared",
            f"{len(tilting.read.pairs)} pairs of configurations, {tilting.used} changes of inclination{pushed}",
        ),
    ]
    dots = (
        "Each dot is the change of one axis of one instrument from the first configuration of a pair to the second. "
        "Axes too steep to see small turns, and links before which a joint may lean to either side, are left out."
    )
    bars = "Bars reach two standard deviations to either side. A joint that no load told is left out."
    return Document(
        f"Tilting joints of {tilting.robot.title} – {source}",
        [
            Facts(facts),
            Section("", [*_accuracy(tilting), _inclinations(tilting), *warned(tilting.warnings)], "result"),
            pictured("angles", "Tilt and backlash of each joint", bars, angles_figure(rows)),
            Section("Compliance of each joint", [Picture("compliances", compliances_figure(rows))]),
            _constants(rows),
            pictured("changes", "Changes of inclination, pair by pair", dots, changes_figure(tilting)),
            *(
                [pictured("errors", "Errors of poses", f"On the {_judged(tilting)}.", errors_figure(tilting))]
                if geometry
                else []
            ),
            _seats(tilting),
        ],
        tilting.command,
        headline=f"Tilting joints of {tilting.robot.title}",
        subtitle=f"Data: {source}{with_geometry}",
        history=tilting.robot.history,
    ).html(tilting)


def _judged(tilting: Tilting) -> str:
    held_out = tilting.geometry is not None and tilting.geometry.validation is not None
    return "configurations that no fit has seen" if held_out else "training configurations"


def _accuracy(tilting: Tilting) -> list[Block]:
    """Return what becomes of the errors of poses, where they were read."""
    spread = [(name, *_figures(errors)) for name, errors in _errors(tilting).items() if errors.position is not None]
    if not spread:
        return []
    (_, nominal, *_), (_, alone, *_), (_, first, *_) = spread
    words = [
        Words(f"Mean position error on the {_judged(tilting)}: geometry alone → tilting first."),
        Words(
            f"Nominal robot: {nominal} mm. The full report of the geometry is geometry.html beside this page.",
            quiet=True,
        ),
    ]
    heading = ("robot", "mean [mm]", "RMS", "95 % below", "maximum")
    return [Lead(words, first, alone, "mm", "position"), Table(heading, spread, look="spread")]


def _inclinations(tilting: Tilting) -> Lead:
    changed, left = (math.degrees(size) for size in tilting.sizes)
    wider = ", by which the deviations below are widened" if tilting.fit.excess > 1 else ""
    words = [
        Words(
            "Changes of inclination that were read, root mean square → what tilt, backlash and compliance leave of "
            "them."
        ),
        Words(
            f"What is left is {tilting.fit.excess:.2f} times as large as the declared deviations{wider}.", quiet=True
        ),
    ]
    return Lead(words, significant(left, 2, 6), significant(changed, 3), "deg", "inclination")


def _constants(rows: list[dict[str, Any]]) -> Section:
    table = Table(
        ("parameter", "what it is", "unit", "value", "deviation", "informed"),
        [
            (
                Cell(row["name"], code=True),
                _WORDS[row["effect"]],
                row["unit"],
                Cell(deserved(row["value"], row["deviation"]), row["value"]),
                Cell(significant(row["deviation"], 2, 7), row["deviation"]),
                f"{100 * (row['informed'] or 0.0):.0f} %",
            )
            for row in rows
        ],
        texts=(1, 2),
        look="parameters sortable",
        marks=tuple("" if row["seen"] else "uninformed" for row in rows),
    )
    words = (
        "Informed is the share of the prior's variance that the readings removed: near 0 %, the value was believed and "
        "not measured (grey)."
    )
    return Section("", [table, Words(words)], "constants")


def _seats(tilting: Tilting) -> Section:
    words = (
        "Found from the angles themselves. Only changes of inclination are used, so zeros do not matter; a turn of the "
        "instrument on its link is taken into account."
    )
    rows = [
        (
            seat["name"],
            f"{seat['turned_deg']:.2f}",
            ", ".join(f"{axis} {zero:+.3f}" for axis, zero in seat["zero_deg"].items()),
        )
        for seat in tilting.seats()
    ]
    table = Table(("instrument", "turned [deg]", "zeros [deg]"), rows, texts=(2,))
    return Section("How the instruments sit", [Words(words), table], "instruments")


def _errors(tilting: Tilting) -> dict[str, Errors]:
    """Return errors by the robot that makes them, on configurations that no fit has seen where some were held out."""
    if tilting.geometry is None or tilting.geometry_alone is None:
        return {}
    return {
        "nominal": tilting.geometry_alone.nominal,
        "geometry alone": tilting.geometry_alone.validation or tilting.geometry_alone.train,
        "tilting first": tilting.geometry.validation or tilting.geometry.train,
    }


def _figures(errors: Errors) -> list[str]:
    spread = errors.position
    if spread is None:
        return []
    return [significant(value * 1e3, 3) for value in (spread.mean, spread.rms, spread.p95, spread.max)]


def angles_figure(rows: list[dict[str, Any]]) -> Figure:
    """Show tilt and backlash of each joint with two standard deviations to either side."""
    return _bars(rows, ("clearance", "backlash"), "angle [deg]")


def compliances_figure(rows: list[dict[str, Any]]) -> Figure:
    """Show how far each joint gives way with two standard deviations to either side."""
    return _bars(rows, ("compliance",), "compliance [mrad/(N m)]")


def _bars(rows: list[dict[str, Any]], effects: tuple[str, ...], title: str) -> Figure:
    traces = []
    for effect in effects:
        known = [row for row in rows if row["effect"] == effect and row["seen"]]
        traces.append(
            {
                "type": "bar",
                "name": _WORDS[effect],
                "x": [f"joint {row['joint']}" for row in known],
                "y": [float(f"{row['value']:.6g}") for row in known],
                "error_y": {
                    "type": "data",
                    "array": [float(f"{2 * row['deviation']:.3g}") for row in known],
                    "thickness": 1.4,
                    "width": 5,
                },
                "marker": {"color": _COLOURS[effect], "line": {"width": 0}},
                "opacity": 0.8,
                "hovertemplate": f"%{{x}}: {_WORDS[effect]} %{{y}}<extra></extra>",
            }
        )
    joints = [f"joint {joint}" for joint in dict.fromkeys(row["joint"] for row in rows)]
    return figure(
        traces,
        330,
        xaxis=axis("") | {"type": "category", "categoryorder": "array", "categoryarray": joints},
        yaxis=axis(title) | {"rangemode": "tozero"},
        barmode="group",
        showlegend=True,
    )


def changes_figure(tilting: Tilting) -> Figure:
    """Show the changes of inclination in the order of measurement, and what is left of them."""
    used = np.isfinite(tilting.fit.left)
    order = np.broadcast_to(np.arange(1, len(used) + 1)[:, None, None], used.shape)[used]
    names = [f"{html.escape(name)}, {letter}" for name in tilting.read.instruments.names for letter in "xyz"]
    labels = np.broadcast_to(np.array(names).reshape(1, -1, 3), used.shape)[used].tolist()
    sizes = [np.abs(np.degrees(values[used])) for values in (tilting.changes.change, tilting.fit.left)]
    low = 1e-5
    traces: list[Figure] = [
        {
            "type": "scatter",
            "mode": "markers",
            "name": name,
            "x": order.tolist(),
            "y": rounded(np.maximum(values, low), 6),
            "customdata": labels,
            "marker": {"color": colour, "size": 5},
            "hovertemplate": f"pair %{{x}}, %{{customdata}}: {name} %{{y:.3g}} deg<extra></extra>",
        }
        for name, values, colour in zip(
            ("change that was read", "what is left of it"), sizes, (BEFORE, AFTER), strict=True
        )
    ]
    high = max(float(sizes[0].max()), 10 * low) if len(order) else 1.0
    return figure(
        traces,
        380,
        xaxis=axis("pair of configurations"),
        yaxis=logarithmic_axis("change of inclination [deg]", low, high),
    )


def errors_figure(tilting: Tilting) -> Figure:
    """Show how errors are distributed, before, with geometry alone, and with tilting first."""
    errors = {name: 1e3 * error.position_norms for name, error in _errors(tilting).items()}
    errors = {name: values for name, values in errors.items() if len(values)}
    every = np.concatenate([*errors.values()]) if errors else np.array([0.1, 1.0])
    low, high = max(float(every.min()), 1e-4) * 0.9, max(float(every.max()), 1e-3) * 1.1
    edges = np.geomspace(low, high, 41)
    traces = [
        {
            "type": "bar",
            "name": name,
            "x": rounded(np.sqrt(edges[:-1] * edges[1:]), 6),
            "width": rounded(np.diff(edges), 6),
            "y": np.histogram(np.clip(values, low, high), edges)[0].tolist(),
            "marker": {"color": colour, "line": {"width": 0}},
            "opacity": 0.75,
            "hovertemplate": f"{name}<br>%{{x:.3g}} mm: %{{y}} readings<extra></extra>",
        }
        for (name, values), colour in zip(errors.items(), (BEFORE, "#b3261e", AFTER), strict=False)
    ]
    return figure(
        traces,
        360,
        xaxis=logarithmic_axis("position error [mm]", low, high),
        yaxis=axis("readings"),
        barmode="overlay",
        bargap=0,
    )
