"""What the report shows in pictures, as plain Plotly figures: dictionaries, so that Plotly need not be imported."""

from __future__ import annotations

import html
from collections.abc import Sequence
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.data.dataset import Dataset
from truearm.engine.diagnose.narrow_data import own_parameters
from truearm.engine.document.drawing import (
    AFTER,
    BEFORE,
    CAMERA,
    Figure,
    axis,
    base_axes,
    figure,
    logarithmic_axis,
    rounded,
    rounded_to,
    scene_axis,
    significant,
)
from truearm.engine.fit.fit import Fit
from truearm.engine.robot.chain import Array

_MARK: Final = "#b3261e"
_ERROR_SCALE: Final = [[0.0, "#c3d5e3"], [0.5, "#2c6f9c"], [0.75, "#4b3a63"], [1.0, "#b3261e"]]
_SIGNED_SCALE: Final = [[0.0, "#b3261e"], [0.5, "#ffffff"], [1.0, AFTER]]

_BINS: Final = 40
#: Cells of a map along the diameter of the workspace.
_CELLS: Final = 30
# Largest error over median error after, beyond which equal bins would crowd everything into the first one.
_LOGARITHMIC: Final = 12.0


def histogram(before: Array, after: Array, unit: str, quantity: str, of: str = "readings") -> Figure:
    """Show how errors are spread before and after, in the same bins.

    Args:
        before, after: Error norms in `unit`.
        quantity: The quantity, for the axis: ``position error``.
        of: What is counted.
    """
    both = np.concatenate([before, after])
    top = max(float(both.max()), 1e-9)
    logarithmic = top > _LOGARITHMIC * float(np.median(after))
    if logarithmic:
        low = max(float(both.min()), 1e-9 * top)
        edges = np.geomspace(low * (1 - 1e-9), top * (1 + 1e-9), _BINS + 1)
    else:
        edges = np.linspace(0.0, top * (1 + 1e-9), _BINS + 1)
    ranges = [f"{a:.3g} to {b:.3g} {unit}" for a, b in pairwise(edges)]
    traces = [
        {
            "type": "bar",
            "name": f"{name}, mean {significant(float(np.mean(errors)))} {unit}",
            "x": rounded((edges[:-1] + edges[1:]) / 2, 6),
            "width": rounded(np.diff(edges), 6),
            "y": np.histogram(np.clip(errors, edges[0], edges[-1]), edges)[0].tolist(),
            "customdata": ranges,
            "marker": {"color": colour, "line": {"width": 0}},
            "opacity": 0.75,
            "hovertemplate": f"{name}<br>%{{customdata}}: %{{y}} {of}<extra></extra>",
        }
        for name, errors, colour in (("before", before, BEFORE), ("after", after, AFTER))
    ]
    x = axis(f"{quantity} [{unit}]")
    if logarithmic:
        x = logarithmic_axis(f"{quantity} [{unit}]", float(edges[0]), float(edges[-1]))
    return figure(traces, 330, xaxis=x, yaxis=axis(of), barmode="overlay", bargap=0)


def workspace(part: Dataset, tips: Array, before: Array, after: Array) -> Figure:
    """Show where readings were taken, coloured by their error, with a switch between before and after.

    Args:
        part: The readings.
        tips: Where the target of each is, in the robot's base frame [m], ``(readings, 3)``.
        before, after: Error of each reading [mm], NaN where none was read.
    """
    finite = np.isfinite(before) & np.isfinite(after)
    before, after = before[finite], after[finite]
    points = tips[finite] * 1e3
    names = [
        [html.escape(part.labels[c]), html.escape(part.targets[t]), b, a]
        for c, t, b, a in zip(
            part.configuration[finite], part.target[finite], rounded(before, 3), rounded(after, 3), strict=True
        )
    ]
    high_before, high_after = _colour_end(before), _colour_end(after)
    views = (
        ("Before", before, high_before),
        ("After, same scale", after, high_before),
        ("After, own scale", after, high_after),
    )
    cloud = {
        "type": "scatter3d",
        "mode": "markers",
        "x": rounded_to(points[:, 0], 1),
        "y": rounded_to(points[:, 1], 1),
        "z": rounded_to(points[:, 2], 1),
        "customdata": names,
        "marker": {
            "size": 4,
            "color": rounded(after, 3),
            "colorscale": _ERROR_SCALE,
            "cmin": 0,
            "cmax": high_after,
            "line": {"width": 0},
            "colorbar": {"title": {"text": "error [mm]"}, "thickness": 14, "len": 0.75, "outlinewidth": 0},
        },
        "hovertemplate": "configuration %{customdata[0]}, target %{customdata[1]}<br>"
        "before %{customdata[2]} mm, after %{customdata[3]} mm<br>"
        "x %{x:.0f}, y %{y:.0f}, z %{z:.0f} mm<extra></extra>",
        "showlegend": False,
    }
    reach = float(np.linalg.norm(points, axis=1).max())
    buttons = [
        {
            "label": label,
            "method": "restyle",
            "args": [{"marker.color": [rounded(errors, 3)], "marker.cmax": [high]}, [0]],
        }
        for label, errors, high in views
    ]
    menu = {
        "type": "buttons",
        "direction": "right",
        "buttons": buttons,
        "active": 2,
        "showactive": True,
        "x": 0,
        "xanchor": "left",
        "y": 1,
        "yanchor": "bottom",
        "pad": {"b": 6},
        "bgcolor": "#ffffff",
        "bordercolor": "#c8ccd0",
    }
    scene = {name: scene_axis(f"{name[0]} [mm]") for name in ("xaxis", "yaxis", "zaxis")}
    return figure(
        [cloud, *base_axes(0.25 * reach)],
        640,
        scene={"aspectmode": "data", "camera": CAMERA, **scene},
        updatemenus=[menu],
        margin={"l": 0, "r": 0, "t": 50, "b": 0},
    )


def expected_error_map(places: Array, error: Array, measured: Array) -> Figure:
    """Show the workspace from the side and from above, coloured by the error to expect, and where was measured.

    Args:
        places, error: Where the targets can be, in the robot's base frame [m], ``(k, 3)``, and the error to expect
            there [m].
        measured: Where they were in the training part, likewise, ``(readings, 3)``.
    """
    top = _colour_end(error * 1e3)
    reach = float(np.abs(places).max()) * 1e3
    views = ((_from_the_side, "distance from the base's z axis", "z"), (_from_above, "x", "y"))
    traces: list[Figure] = []
    axes: Figure = {}
    for number, (seen, right, up) in enumerate(views, start=1):
        points, dots = seen(places) * 1e3, seen(measured) * 1e3
        low, high = np.floor(points.min(axis=0)), np.ceil(points.max(axis=0))
        edges = [
            np.linspace(a, b, max(2, round((b - a) / (2 * reach) * _CELLS) + 1)) for a, b in zip(low, high, strict=True)
        ]
        count = np.histogram2d(points[:, 0], points[:, 1], edges)[0]
        total = np.histogram2d(points[:, 0], points[:, 1], edges, weights=error * 1e3)[0]
        mean = total / np.where(count > 0, count, np.nan)
        place = {"xaxis": f"x{number}", "yaxis": f"y{number}"}
        traces.append(
            {
                "type": "heatmap",
                **{letter: rounded_to((e[:-1] + e[1:]) / 2, 1) for letter, e in zip("xy", edges, strict=True)},
                "z": [[None if np.isnan(v) else float(f"{v:.3g}") for v in row] for row in mean.T],
                "coloraxis": "coloraxis",
                "hovertemplate": f"{right} %{{x:.0f}} mm, {up} %{{y:.0f}} mm<br>%{{z:.3g}} mm to expect<extra></extra>",
                **place,
            }
        )
        traces.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": "measured in the training part",
                "x": rounded_to(dots[:, 0], 1),
                "y": rounded_to(dots[:, 1], 1),
                "marker": {"size": 4, "color": "#ffffff", "line": {"color": "#000000", "width": 1}},
                "hoverinfo": "skip",
                "showlegend": number == 1,
                **place,
            }
        )
        left = 0.56 * (number - 1)
        axes[f"xaxis{number}"] = {**axis(f"{right} [mm]"), "anchor": f"y{number}", "domain": [left, left + 0.44]}
        axes[f"yaxis{number}"] = {
            **axis(f"{up} [mm]"),
            "anchor": f"x{number}",
            "scaleanchor": f"x{number}",
            "constrain": "domain",
        }
    bar = {"title": {"text": "expected error [mm]"}, "thickness": 14, "outlinewidth": 0}
    return figure(traces, 480, **axes, coloraxis={"colorscale": _ERROR_SCALE, "cmin": 0, "cmax": top, "colorbar": bar})


def _from_the_side(points: Array) -> Array:
    """Return distances from the z axis and heights, ``(n, 2)``."""
    return np.column_stack([np.hypot(points[:, 0], points[:, 1]), points[:, 2]])


def _from_above(points: Array) -> Array:
    return points[:, :2]


def residuals(
    data: Dataset, parts: Sequence[tuple[str, NDArray[np.intp], Array]], down_weighted: NDArray[np.bool_]
) -> Figure:
    """Show the error after calibration of every configuration, mean over its targets, as measured.

    Args:
        data: All readings.
        parts: Training and then held-out: name, indices of the configurations, error of each reading [mm].
        down_weighted: Which training readings the loss gave little weight.
    """
    looks = ({"symbol": "circle-open", "size": 6}, {"symbol": "diamond", "size": 6})
    traces: list[Figure] = []
    for (name, indices, errors), look in zip(parts, looks, strict=False):
        if len(indices) == 0:
            continue
        place = data.of_configurations(indices).configuration
        read = np.isfinite(errors)
        count = np.bincount(place[read], minlength=len(indices))
        total = np.bincount(place[read], errors[read], minlength=len(indices))
        order = np.argsort(indices)
        order = order[count[order] > 0]
        traces.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": name,
                "x": (indices[order] + 1).tolist(),
                "y": rounded(total[order] / count[order], 4),
                "customdata": [html.escape(data.labels[i]) for i in indices[order]],
                "marker": {"color": AFTER, **look},
                "hovertemplate": f"configuration %{{customdata}}, {name}<br>mean over targets "
                "%{y:.3g} mm<extra></extra>",
            }
        )
    _, training, errors = parts[0]
    marked = np.flatnonzero(down_weighted & np.isfinite(errors))
    if len(marked):
        part = data.of_configurations(training)
        configuration = part.configuration[marked]
        traces.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": "single readings with little weight",
                "x": (training[configuration] + 1).tolist(),
                "y": rounded(errors[marked], 4),
                "customdata": [
                    [html.escape(part.labels[c]), html.escape(part.targets[t])]
                    for c, t in zip(configuration, part.target[marked], strict=True)
                ],
                "marker": {"color": _MARK, "symbol": "x-thin", "size": 8, "line": {"color": _MARK, "width": 1.5}},
                "hovertemplate": "configuration %{customdata[0]}, target %{customdata[1]}<br>"
                "less than half of a typical weight, %{y:.3g} mm<extra></extra>",
            }
        )
    shown = np.concatenate([np.asarray(trace["y"], float) for trace in traces]) if traces else np.ones(1)
    y = axis("error [mm]")
    if shown.max() > 2 * _LOGARITHMIC * float(np.median(shown)) and shown.min() > 0:
        y = logarithmic_axis("error [mm]", float(shown.min()), float(shown.max()))
    else:
        y["rangemode"] = "tozero"
    return figure(traces, 360, xaxis=axis("configuration"), yaxis=y)


def correlation_map(fit: Fit) -> Figure:
    """Show the correlations of the arm's own free parameters; of all where the arm was not free."""
    own = own_parameters(fit)
    names = [html.escape(fit.free.names[i]) for i in own]
    size = min(18.0, 860.0 / max(len(names), 1))
    ticks = {"tickfont": {"size": max(5, min(11, round(0.68 * size)))}, "ticks": "", "dtick": 1, "showgrid": False}
    trace = {
        "type": "heatmap",
        "x": names,
        "y": names,
        "z": rounded_to(fit.correlations[np.ix_(own, own)], 2),
        "zmin": -1,
        "zmax": 1,
        "xgap": 0.5,
        "ygap": 0.5,
        "colorscale": _SIGNED_SCALE,
        "colorbar": {"thickness": 14, "outlinewidth": 0, "tickvals": [-1, -0.5, 0, 0.5, 1]},
        "hovertemplate": "%{y}, %{x}: %{z:.2f}<extra></extra>",
    }
    return figure(
        [trace],
        max(260, round(size * len(names)) + 130),
        xaxis={"automargin": True, "tickangle": -90, "constrain": "domain", **ticks},
        yaxis={"automargin": True, "autorange": "reversed", "scaleanchor": "x", "constrain": "domain", **ticks},
    )


def _colour_end(errors: Array) -> float:
    """Return where the colours end: at the largest error, unless outliers would then hide all other differences."""
    end = min(float(errors.max()), 2.0 * float(np.percentile(errors, 90)))
    return float(f"{max(end, 1e-9):.2g}")
