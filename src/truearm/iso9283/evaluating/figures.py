"""Pictures of tests by ISO 9283 at poses: attained poses, approaches, accuracy in the cube, drift, coming to rest."""

from __future__ import annotations

import html
import math
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np

from truearm.engine.document.document import Section, pictured
from truearm.engine.document.drawing import (
    AFTER,
    BEFORE,
    CAMERA,
    COLOURS,
    HUES,
    INK,
    SHADE,
    Figure,
    Panel,
    axis,
    figure,
    line,
    panels,
    rounded_to,
    scene_axis,
)
from truearm.engine.motion.cube import DiagonalPlane
from truearm.engine.robot.chain import Array
from truearm.iso9283.criteria.compliance import PushLine
from truearm.iso9283.criteria.drift import DriftCourse
from truearm.iso9283.criteria.poses import PoseCloud
from truearm.iso9283.criteria.rows import Conditions
from truearm.iso9283.criteria.settling import SettlingCurve
from truearm.iso9283.evaluating.comparison import Comparison, key_of
from truearm.iso9283.evaluating.table import conditions_summary
from truearm.iso9283.planning.criteria import PerformancePlan

#: Arrows of errors are as long as this share of the cube's side.
_ARROW: Final = 0.15
#: Where the camera is before the plane of the cube, and aside.
_FRONT, _ASIDE = 1.7, 1.2
_MOST_SAMPLES: Final = 400
_CIRCLE: Final = np.linspace(0.0, 2.0 * np.pi, 73)


def fastest(things: Sequence[PoseCloud]) -> list[PoseCloud]:
    """Return those at the fastest velocity and the largest load."""
    velocity = max((thing.velocity for thing in things), default=0.0)
    of_it = [thing for thing in things if thing.velocity == velocity]
    load = max((thing.load for thing in of_it), default=0.0)
    return [thing for thing in of_it if thing.load == load]


def thinned(count: int, most: int = _MOST_SAMPLES) -> np.ndarray:
    """Return which of so many samples are drawn."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.intp))


def dots(name: str, x: Array, y: Array, colour: str, size: float = 5.0, symbol: str = "circle") -> Figure:
    """Return points."""
    return {
        "type": "scatter",
        "mode": "markers",
        "name": html.escape(name),
        "x": rounded_to(x, 4),
        "y": rounded_to(y, 4),
        "marker": {"color": colour, "size": size, "symbol": symbol},
        "hoverinfo": "x+y+name",
    }


def pose_pictures(
    plan: PerformancePlan,
    clouds: Sequence[PoseCloud],
    drift: Sequence[DriftCourse],
    settling: Sequence[SettlingCurve],
    pushes: Sequence[PushLine],
    other: Comparison | None = None,
) -> list[Section]:
    """Return the pictures of what was measured at poses.

    Args:
        other: Another result, whose accuracy is drawn beside this one's.
    """
    drawings: list[Section] = []
    accuracy = fastest([cloud for cloud in clouds if cloud.test == "AP"])
    # Of several robots the first: the picture is of one.
    accuracy = sorted((cloud for cloud in accuracy if cloud.robot == accuracy[0].robot), key=lambda cloud: cloud.pose)
    if accuracy:
        under = _under(accuracy[0])
        drawings.append(
            pictured(
                "clouds",
                "Attained poses about their barycentre",
                f"Each point is a cycle {under}; the circle is the sphere of RP about the barycentre.",
                _clouds(accuracy),
            )
        )
        drawings.append(_accuracy(plan, accuracy, under, other))
    of_test = {test: fastest([cloud for cloud in clouds if cloud.test == test]) for test in ("vAP", "E")}
    others: list[tuple[Sequence[Any], str, str, str, Callable[[Any], Figure]]] = [
        (
            of_test["vAP"],
            "approaches",
            "Attained poses by approach",
            "vAP is the largest distance between two barycentres, the large marks. The middle of them is 0.",
            lambda shown: _together(shown, lambda cloud: f"from {cloud.approach}"),
        ),
        (
            of_test["E"],
            "robots",
            "Attained poses by robot",
            "E is the largest distance between two barycentres, the large marks. The middle of them is 0.",
            lambda shown: _together(shown, lambda cloud: cloud.robot),
        ),
        (
            [course for course in drift if len(course.ap) > 1],
            "drift",
            "Drift from cold",
            "Change of AP and RP against the first value; dAP and dRP are the largest.",
            lambda shown: _drift(shown[0]),
        ),
        (
            [curve for curve in settling if curve.test == "t"],
            "settling",
            "Coming to rest",
            "Distance from the final attained pose. Grey: the limit band. t goes from the first entry into it, the "
            "first dashed line, to the final stay, the second, of the first cycle; OV is what lies above the band "
            "between them.",
            _settling,
        ),
        (
            [curve for curve in settling if curve.test == "posing-time"],
            "posing-time",
            "Posing time over distance",
            "From the begin of the motion to the final stay in the limit band, each cycle.",
            _posing,
        ),
        (
            pushes,
            "compliance",
            "Displacement under force",
            "Along the force, each cycle with the straight line whose slope is its compliance.",
            _pushes,
        ),
    ]
    return drawings + [pictured(name, title, words, draw(shown)) for shown, name, title, words, draw in others if shown]


def _under(cloud: PoseCloud) -> str:
    return f"at {100 * cloud.velocity:g} % of the rated velocity and {100 * cloud.load:g} % of the rated load"


def _clouds(clouds: Sequence[PoseCloud]) -> Figure:
    drawn = []
    for right, up in ((0, 1), (0, 2)):
        for cloud in clouds:
            about = (cloud.points - cloud.barycentre) * 1e6
            radius = cloud.rp * 1e6 if np.isfinite(cloud.rp) else 0.0
            traces = [
                line("sphere of RP", radius * np.cos(_CIRCLE), radius * np.sin(_CIRCLE), AFTER),
                dots("attained pose", about[:, right], about[:, up], BEFORE, 4),
                dots("barycentre", np.zeros(1), np.zeros(1), COLOURS[0], 8, "cross"),
            ]
            title = f"{html.escape(cloud.pose)}: RP {radius:.1f} um"
            drawn.append(Panel(title, traces, f"{'xyz'[right]} [um]", f"{'xyz'[up]} [um]", equal=True))
    return panels(drawn, len(clouds), 190)


def _offsets(clouds: Sequence[PoseCloud], other: Comparison | None) -> Array:
    """Return how far the barycentres of another result are from their commands [m], NaN where it has none."""
    offsets = np.full((len(clouds), 3), np.nan)
    for row, cloud in enumerate(clouds) if other is not None else ():
        under = conditions_summary(Conditions(cloud.velocity, cloud.load, cloud.robot))
        offset = other.offsets.get(key_of(cloud.test, cloud.pose, under)) if other is not None else None
        if offset is not None:
            offsets[row] = 1e-3 * np.array(offset)
    return offsets


def _accuracy(plan: PerformancePlan, clouds: Sequence[PoseCloud], under: str, other: Comparison | None) -> Section:
    command = np.array([cloud.command for cloud in clouds])
    away = np.array([cloud.barycentre for cloud in clouds]) - command
    beside = _offsets(clouds, other)
    length = np.linalg.norm(away, axis=1)
    largest = float(np.nanmax(np.concatenate([length, np.linalg.norm(beside, axis=1)])))
    times = _times(_ARROW * plan.cube.side / largest) if largest > 0.0 else 1.0
    around = plan.cube.plane(plan.plane).points([1, -1, -1, 1, 1], [1, 1, -1, -1, 1]) * 1e3
    tips = (command + times * away) * 1e3
    feet = command * 1e3
    gap = np.full((len(clouds), 3), np.nan)

    def arrows(to: Array) -> Array:
        return np.stack([feet, to, gap], axis=1).reshape(-1, 3)

    traces: list[Figure] = [
        _in_space("plane of the cube", around, "lines", line={"color": "#9aa0a6", "width": 3}),
        _in_space(
            "command",
            feet,
            "markers+text",
            marker={"color": INK, "size": 3},
            text=[html.escape(cloud.pose) for cloud in clouds],
            textposition="top center",
        ),
        _in_space(f"to the barycentre, times {times:g}", arrows(tips), "lines", line={"color": COLOURS[0], "width": 5}),
        _in_space(
            "barycentre",
            tips,
            "markers",
            marker={"color": COLOURS[0], "size": 4, "symbol": "diamond"},
            customdata=rounded_to(length * 1e3, 4),
            hovertemplate="AP %{customdata:.4f} mm<extra></extra>",
        ),
    ]
    words = f"Where the poses are on average {under}, in the base frame; arrows are {times:g} times as long as AP."
    if np.isfinite(beside).any():
        before = arrows((command + times * beside) * 1e3)
        traces.insert(2, _in_space("of the other result", before, "lines", line={"color": BEFORE, "width": 5}))
        words += " The pale ones are those of the other result."
    scene = {f"{letter}axis": scene_axis(f"{letter} [mm]") for letter in "xyz"}
    drawn = figure(
        traces,
        520,
        scene={**scene, "aspectmode": "data", "camera": _before(plan.cube.plane(plan.plane))},
        margin={"l": 0, "r": 0, "t": 40, "b": 0},
    )
    return pictured("accuracy", "Pose accuracy in the cube", words, drawn)


def _before(plane: DiagonalPlane) -> Figure:
    """Return a camera in front of a plane of the cube, a little aside and above, so that no label lies on an edge."""
    normal = plane.normal if plane.normal[2] >= 0.0 else -plane.normal
    eye = _FRONT * normal + _ASIDE * plane.along
    return {**CAMERA, "eye": dict(zip("xyz", np.round(eye, 3).tolist(), strict=True))}


def _times(most: float) -> float:
    """Return the largest of 1, 2 and 5 times a power of ten that is not above a number."""
    decade = 10.0 ** math.floor(math.log10(most))
    return max(step * decade for step in (1.0, 2.0, 5.0) if step * decade <= most)


def _in_space(name: str, points: Array, mode: str, **more: object) -> Figure:
    columns = {
        letter: [None if np.isnan(v) else round(float(v), 4) for v in column]
        for letter, column in zip("xyz", points.T, strict=True)
    }
    return {"type": "scatter3d", "mode": mode, "name": name, **columns, **more}


def _together(clouds: Sequence[PoseCloud], series: Callable[[PoseCloud], str]) -> Figure:
    """Draw clouds at the same pose about the middle of their barycentres."""
    names = list(dict.fromkeys(map(series, clouds)))
    poses = sorted({cloud.pose for cloud in clouds})
    middles = {p: np.mean([c.barycentre for c in clouds if c.pose == p], axis=0) for p in poses}
    largest = max(float(np.abs(cloud.points - middles[cloud.pose]).max()) for cloud in clouds)
    unit, per_m = ("um", 1e6) if largest < 1e-3 else ("mm", 1e3)
    drawn = []
    for right, up in ((0, 1), (0, 2)):
        for pose in poses:
            traces = []
            for cloud in clouds:
                if cloud.pose != pose:
                    continue
                colour = HUES[names.index(series(cloud)) % len(HUES)]
                points = (cloud.points - middles[pose]) * per_m
                middle = points.mean(axis=0)
                traces.append(dots("", points[:, right], points[:, up], colour, 3.5))
                traces.append(dots(series(cloud), middle[[right]], middle[[up]], colour, 11, "cross"))
            drawn.append(
                Panel(html.escape(pose), traces, f"{'xyz'[right]} [{unit}]", f"{'xyz'[up]} [{unit}]", equal=True)
            )
    return panels(drawn, len(poses), 210)


def _drift(course: DriftCourse) -> Figure:
    timed = bool(np.isfinite(course.time).all())
    x = course.time / 3600.0 if timed else np.arange(1.0, len(course.ap) + 1)
    traces = []
    for name, values, colour in (("AP", course.ap, AFTER), ("RP", course.rp, COLOURS[0])):
        if np.isfinite(values).all():
            traces.append(
                line(name, x, (values - values[0]) * 1e6, colour, 2.0)
                | {"mode": "lines+markers", "marker": {"size": 6}}
            )
    return figure(
        traces,
        340,
        xaxis=axis("since the begin, from cold [h]" if timed else "group of cycles"),
        yaxis=axis("change against the first [um]"),
    )


def _settling(curves: Sequence[SettlingCurve]) -> Figure:
    first = curves[0]
    traces = []
    around = 1.5 * (first.stay - first.entry) + 0.02
    start, end = max(first.entry - around, first.start), first.stay + around
    for number, curve in enumerate(curves):
        inside = np.flatnonzero((curve.time >= start) & (curve.time <= end))
        if len(inside) == 0:
            continue
        rows = inside[thinned(len(inside))]
        traces.append(
            line(f"cycle {curve.cycle}", curve.time[rows], curve.distance[rows] * 1e3, HUES[number % len(HUES)])
        )
    top = 3.0 * max(first.overshoot, first.band) * 1e3
    edge: Figure = {
        "type": "line",
        "yref": "paper",
        "y0": 0,
        "y1": 1,
        "line": {"color": INK, "width": 1, "dash": "dash"},
    }
    return figure(
        traces,
        360,
        xaxis=axis("since the first sample [s]"),
        yaxis={**axis("from the final pose [mm]"), "range": [0, top]},
        shapes=[
            {
                "type": "rect",
                "xref": "paper",
                "x0": 0,
                "x1": 1,
                "y0": 0,
                "y1": first.band * 1e3,
                "fillcolor": SHADE,
                "line": {"width": 0},
                "layer": "below",
            },
            *(edge | {"x0": round(when, 5), "x1": round(when, 5)} for when in (first.entry, first.stay)),
        ],
    )


def _posing(curves: Sequence[SettlingCurve]) -> Figure:
    distance = np.array([curve.travelled for curve in curves]) * 1e3
    time = np.array([curve.stay - curve.start for curve in curves])
    return figure(
        [dots("cycle", distance, time, AFTER, 7)],
        320,
        xaxis={**axis("distance [mm]"), "rangemode": "tozero"},
        yaxis={**axis("posing time [s]"), "rangemode": "tozero"},
    )


def _pushes(pushes: Sequence[PushLine]) -> Figure:
    drawn = []
    for direction in dict.fromkeys(push.direction for push in pushes):
        traces = []
        for number, push in enumerate(curve for curve in pushes if curve.direction == direction):
            colour = HUES[number % len(HUES)]
            ends = np.array([0.0, push.force.max()])
            traces.append(dots(f"cycle {push.cycle}", push.force, push.displacement * 1e6, colour, 5))
            traces.append(line("", ends, push.slope * ends * 1e6, colour, 1.5))
        drawn.append(Panel(direction, traces, "force [N]", "displacement [um]"))
    return panels(drawn, 3, 200)
