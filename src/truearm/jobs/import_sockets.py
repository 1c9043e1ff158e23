"""Measurements from a ball that was put into two sockets."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from truearm.errors import InputError, refusals_of
from truearm.files import path_argument
from truearm.jobs.arguments import deviation_argument, file_for, length_argument, numbers_argument
from truearm.measurement.readers.canonical import csv_text
from truearm.measurement.readers.sockets import Apart, read_sockets
from truearm.results.imported import Imported
from truearm.units import quantity_si
from truearm.writing import write_text

#: A distance with a larger share of doubt was not measured: a tape measure leaves one in a hundred.
_VAGUEST: Final = 0.1


def import_sockets(
    file: str | Path,
    *,
    apart: str | Sequence[float],
    ball: str | float,
    sigma: float | None = None,
    out: str | Path | None = None,
) -> Imported:
    """Read in which of two sockets a ball on the flange was, and at which joint positions.

    Parameters
    ----------
    file
        CSV with the columns ``configuration``, ``joint_1 [deg]`` .. or ``axis_1 [deg]`` .., and ``socket``.
    apart
        Distance of the sockets' centres and its standard deviation, as a text with units, ``200mm,0.02mm``, or both as
        numbers [m].
    ball
        Diameter of the ball, as a text with its unit, ``25mm``, or a number [m].
    sigma
        How well the ball comes to rest in a socket: standard deviation of each coordinate [m]; None declares none.
    out
        Canonical CSV file to write; None writes nothing.

    Raises
    ------
    InputError
        If there are not two sockets, they are closer than the ball is large, or a file cannot be used.
    """
    table = path_argument(file, "file")
    if isinstance(apart, str):
        known = Apart.of_text(apart)
    else:
        distance, deviation = numbers_argument(apart, "apart", 2, "200mm,0.02mm, or two numbers in m")
        known = Apart(length_argument(distance, "apart", 0.0), deviation_argument(deviation, "apart"))
    if known.sigma > _VAGUEST * known.distance:
        raise InputError(
            "the distance of the sockets is hardly known, and nothing else says how long anything is",
            parameter="apart",
            came=f"{1e3 * known.distance:g} mm with a standard deviation of {1e3 * known.sigma:g} mm",
            allowed=f"a standard deviation of up to {_VAGUEST:.0%} of the distance",
            cure="Measure the distance with a caliper, and give its deviation second: 200mm,0.02mm.",
        )
    if isinstance(ball, str):
        diameter = quantity_si(ball, ("mm", "m", "um", "in"), "ball", "25", "25mm")
    else:
        diameter = length_argument(ball, "ball")
    if diameter <= 0.0:
        raise InputError("the ball has no size", parameter="ball", came=f"{1e3 * diameter:g} mm", allowed="above 0 mm")
    rest = None if sigma is None else deviation_argument(sigma, "sigma")
    target = None if out is None else file_for(out, table)
    with refusals_of("file"):
        data = read_sockets(table, known, diameter, rest)
    if target is not None:
        write_text(target, csv_text(data))
    return Imported(data, target)
