"""``truearm distances``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.cli.loading import GravityText, PayloadText, read_gravity, read_payload
from truearm.cli.output import Json, print_json
from truearm.errors import InputError


def distances(
    robot_file: Annotated[str, typer.Argument(metavar="ROBOT_FILE", help="A calibrated.yaml.")],
    data: Annotated[Path, typer.Argument(metavar="DATA.csv", help="Measurements, of whatever instrument's frame.")],
    payload: PayloadText = None,
    gravity: GravityText = None,
    json: Json = False,
) -> None:
    """Judge a robot by the distances between all pairs of measured points; no common frame is needed."""
    import numpy as np

    from truearm.calibration import check_joints
    from truearm.measurement.readers.canonical import read_csv
    from truearm.measurement.statistics import errors_of
    from truearm.robots import load_robot
    from truearm.validation.pair_distances import pair_distances

    robot = load_robot(robot_file).carrying(read_payload(payload), read_gravity(gravity))
    readings = read_csv(data)
    check_joints(robot, readings)
    if not robot.targets:
        raise InputError(
            "the robot has no targets to be measured",
            where=robot.name,
            cure="Use the calibrated.yaml that a calibration wrote.",
        )
    seen = readings.has_position
    off = errors_of(robot, readings).position[seen]
    measured = readings.position[seen]
    found = pair_distances(measured + off, measured, readings.configuration[seen])
    edges = np.round(found.edges * 1e3, 9).tolist()
    summary = {
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
    typer.echo(f"  mean {d['mean']:.3f}  deviation {d['deviation']:.3f}  max {d['max']:.3f} mm")  # type: ignore[index]
    typer.echo(f"  {100 * found.positive:.0f} % of the predicted distances are too long")
    most = max(found.counts.tolist())
    grouped = max(1, len(found.counts) // 20)
    for first in range(0, len(found.counts), grouped):
        part = found.counts[first : first + grouped]
        bar = "#" * round(50 * float(part.mean()) / most)
        typer.echo(f"  {edges[first]:8.3f} to {edges[min(first + grouped, len(part) + first)]:8.3f} mm  {bar}")
