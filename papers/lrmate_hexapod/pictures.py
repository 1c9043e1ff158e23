"""Pictures of the LR Mate's study: errors against distance (Figure 4.7) and of distances (Figure 4.8)."""

from __future__ import annotations

from typing import Final

import numpy as np

from papers.lrmate_hexapod.run import Model, Outcome
from papers.study import Picture
from truearm.engine.document.drawing import AFTER, BEFORE, COLOURS, Figure, axis, figure, rounded, rounded_to
from truearm.engine.motion.cell import skeleton
from truearm.engine.robot.robot import Robot
from truearm.validation.distances import PairDistances

#: Points drawn at most, and width of the bands of distance [m].
_POINTS: Final = 1500
_BAND: Final = 0.1
#: Bands with fewer configurations are not drawn.
_FEW: Final = 10
#: Arms side by side, and the room that each has [m].
_COLUMNS: Final = 9
_CELL: Final = 1.1
_DISTANCE: Final = "distance from the reference point [mm]"
_ERROR: Final = "position error [mm]"


def away_pictures(first: Outcome) -> tuple[Picture, ...]:
    """Draw position errors of one seed against the distance from the calibrated region."""
    return (
        _bands(first),
        _scattered("preliminary held", "Preliminary calibration, base held (Figure 4.7a)", first),
        _scattered("final held", "Final calibration, base held (Figure 4.7b)", first),
        _scattered("final following", "Final calibration, base following (Figure 4.7b)", first),
    )


def _bands(first: Outcome) -> Picture:
    band = np.floor(first.away / _BAND).astype(int)
    drawn = [number for number in range(band.max() + 1) if np.sum(band == number) >= _FEW]
    traces: list[Figure] = []
    shown: tuple[tuple[Model, str, str, str], ...] = (
        ("preliminary held", "preliminary, base held", COLOURS[0], "dot"),
        ("final held", "final, base held", COLOURS[0], "solid"),
        ("preliminary following", "preliminary, base following", COLOURS[2], "dot"),
        ("final following", "final, base following", COLOURS[2], "solid"),
        ("preliminary found", "preliminary, base and cups found", AFTER, "dot"),
        ("final found", "final, base and cups found", AFTER, "solid"),
        ("tracker", "tracker", COLOURS[1], "solid"),
    )
    for name, words, colour, dash in shown:
        errors = first.judgements[name].position
        traces.append(
            {
                "type": "scatter",
                "mode": "lines+markers",
                "name": words,
                "x": [1e3 * _BAND * (number + 0.5) for number in drawn],
                "y": rounded_to(1e3 * np.array([errors[band == number].mean() for number in drawn]), 4),
                "line": {"color": colour, "dash": dash},
                "hovertemplate": f"{words}: %{{y:.3f}} mm<extra></extra>",
            }
        )
    return Picture(
        "away",
        "Mean position error against the distance from the fixture",
        "All configurations in bands of 100 mm, first seed. The device measures within some 250 mm of the reference"
        " point; a tracker sees the whole workspace.",
        figure(traces, 420, xaxis=axis(_DISTANCE), yaxis=axis(f"mean {_ERROR}") | {"rangemode": "tozero"}),
    )


def _scattered(name: Model, title: str, first: Outcome) -> Picture:
    away, front_up = first.away, first.front_up
    every = max(1, -(-len(away) // _POINTS))
    traces: list[Figure] = [
        {
            "type": "scatter",
            "mode": "markers",
            "name": words,
            "x": rounded_to(1e3 * away[chosen][::every], 1),
            "y": rounded_to(1e3 * first.judgements[name].position[chosen][::every], 4),
            "marker": {"color": colour, "size": 4},
            "hovertemplate": "%{x:.0f} mm away: %{y:.3f} mm<extra></extra>",
        }
        for words, colour, chosen in (("others", BEFORE, ~front_up), ("front/up", AFTER, front_up))
    ]
    shown = "All configurations" if every == 1 else f"One of {every} configurations"
    return Picture(
        f"away-{name.replace(' ', '-')}",
        title,
        f"{shown}, first seed.",
        figure(traces, 380, xaxis=axis(_DISTANCE), yaxis=axis(_ERROR) | {"rangemode": "tozero"}),
    )


def distance_pictures(first: Outcome) -> tuple[Picture, ...]:
    """Draw the histograms of distance errors of both calibrations as printed, and of a tracker's."""
    shown: tuple[tuple[Model, str], ...] = (
        ("preliminary held", "preliminary calibration, base held (Figure 4.8a)"),
        ("final held", "final calibration, base held (Figure 4.8b)"),
        ("final following", "final calibration, base following (Figure 4.8b)"),
        ("tracker", "tracker"),
    )
    return tuple(
        Picture(
            f"distances-{name.replace(' ', '-')}",
            f"Distance errors, {words}",
            "Predicted minus true, of all pairs and of those in which both are front/up; first seed.",
            figure(
                [
                    _steps("all pairs", BEFORE, first.judgements[name].pairs),
                    _steps("both front/up", AFTER, first.judgements[name].pairs_front_up),
                ],
                340,
                xaxis=axis("distance error [mm]"),
                yaxis=axis("share of the pairs per mm"),
            ),
        )
        for name, words in shown
    )


def _steps(words: str, colour: str, pairs: PairDistances) -> Figure:
    edges = 1e3 * pairs.edges
    share = pairs.counts / pairs.pairs / np.diff(edges)
    return {
        "type": "scatter",
        "mode": "lines",
        "name": words,
        "x": rounded(edges, 6),
        "y": rounded(np.append(share, share[-1]), 4),
        "line": {"shape": "hv", "color": colour},
        "hovertemplate": f"{words}: %{{x:.3f}} mm<extra></extra>",
    }


def arms_picture(robot: Robot, first: Outcome) -> Picture:
    """Draw the measured configurations, as in Figure 4.6."""
    data = first.campaign.data
    rows = (*first.campaign.first, *first.campaign.second)
    joints = np.stack(skeleton(robot, data.joints), axis=1)
    turn = data.joints[:, 0]
    # Side view: along the direction in which joint 1 turns the arm, and up.
    along = joints[:, :, 0] * np.cos(turn)[:, None] + joints[:, :, 1] * np.sin(turn)[:, None]
    traces: list[Figure] = []
    for words, colour, front in (("front/up", AFTER, True), ("back/down", "#b3261e", False)):
        x: list[float | None] = []
        y: list[float | None] = []
        for number, row in enumerate(rows):
            if first.front[row] == front:
                column, line = number % _COLUMNS, number // _COLUMNS
                x += [*rounded_to(along[number] + _CELL * column, 4), None]
                y += [*rounded_to(joints[number, :, 2] - _CELL * line, 4), None]
        traces.append(
            {
                "type": "scatter",
                "mode": "lines+markers",
                "name": words,
                "x": x,
                "y": y,
                "line": {"color": colour, "width": 1.5},
                "marker": {"color": colour, "size": 3},
                "hoverinfo": "skip",
            }
        )
    labels = [
        {
            "text": f"{'F' if first.front[row] else 'B'} {data.labels[number].partition('#')[0]}",
            "x": _CELL * (number % _COLUMNS),
            "y": -_CELL * (number // _COLUMNS) - 0.1,
            "showarrow": False,
            "font": {"size": 10},
        }
        for number, row in enumerate(rows)
    ]
    hidden = {"visible": False}
    return Picture(
        "arms",
        "Measured configurations, as in Figure 4.6",
        "First seed, in the order of measurement, each seen from the side in the plane of joint 1: base below,"
        " flange at the end. F is front/up, B back/down, the number that of the row.",
        figure(traces, 860, xaxis=hidden, yaxis=hidden | {"scaleanchor": "x"}, annotations=labels),
    )
