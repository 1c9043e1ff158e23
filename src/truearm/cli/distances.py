"""``truearm distances``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from truearm.cli.loading import GravityText, PayloadText, read_gravity, read_payload
from truearm.cli.output import Json, print_json


def distances(
    robot_file: Annotated[str, typer.Argument(metavar="ROBOT_FILE", help="A calibrated.yaml.")],
    data: Annotated[Path, typer.Argument(metavar="DATA.csv", help="Measurements, of whatever instrument's frame.")],
    payload: PayloadText = None,
    gravity: GravityText = None,
    json: Json = False,
) -> None:
    """Judge a robot by the distances between all pairs of measured points; no common frame is needed."""
    import numpy as np

    from truearm.jobs.validate import validate
    from truearm.measurement.readers.canonical import read_csv
    from truearm.validation.pair_distances import pair_distances

    readings = read_csv(data)
    errors = validate(robot_file, readings, payload=read_payload(payload), gravity=read_gravity(gravity))
    seen = readings.has_position
    measured = readings.position[seen]
    found = pair_distances(measured + errors.errors.position_errors[seen], measured, readings.configuration[seen])
    edges = np.round(found.edges * 1e3, 9).tolist()
    summary: dict[str, Any] = {
        "configurations": readings.configurations,
        "pairs": found.pairs,
        "distance_mm": {
            "mean": found.mean * 1e3,
            "deviation": found.deviation * 1e3,
            "max": found.maximum * 1e3,
        },
        "positive": found.positive,
        "histogram": {"edges_mm": edges, "counts": found.counts.tolist()},
    }
    if json:
        print_json(summary)
        return
    d = summary["distance_mm"]
    typer.echo(f"{found.pairs} distances between points of {readings.configurations} configurations of {data}:")
    typer.echo(f"  mean {d['mean']:.3f}  deviation {d['deviation']:.3f}  max {d['max']:.3f} mm")
    typer.echo(f"  {100 * found.positive:.0f} % of the predicted distances are too long")
    step = max(1, len(found.counts) // 20)
    starts = range(0, len(found.counts), step)
    sums = [int(found.counts[first : first + step].sum()) for first in starts]
    for first, count in zip(starts, sums, strict=True):
        last = min(first + step, len(found.counts))
        typer.echo(f"  {edges[first]:8.3f} to {edges[last]:8.3f} mm  {'#' * round(50 * count / max(sums))}".rstrip())
