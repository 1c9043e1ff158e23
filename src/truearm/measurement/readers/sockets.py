"""A ball that was put into two sockets, again and again: joint positions, and in which socket.

Franzese, Spahn, Kober and Della Santina 2025, "MUKCa: Accurate and Affordable Cobot Calibration Without External
Measurement Devices".
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.measurement.dataset import Dataset
from truearm.measurement.readers.columns import columns_beside_joints, configurations_of, read_named, refuse_repeated
from truearm.measurement.readers.rows import Readings, dataset_of
from truearm.units import quantity_si

#: What the ball is called.
BALL: Final = "ball"
_SHOWN: Final = {"configuration": "configuration", "socket": "socket"}
_WHOLE: Final = "200mm,0.02mm"
_LENGTHS: Final = ("mm", "m", "um", "in")


@dataclass(frozen=True)
class Apart:
    """How far apart two sockets are."""

    distance: float  #: Of the centres of a ball in them [m].
    sigma: float  #: Its standard deviation [m].

    @classmethod
    def of_text(cls, text: str, parameter: str = "apart") -> Apart:
        """Return what a text such as ``200mm,0.02mm`` says: the distance and its standard deviation, with units."""
        parts = text.split(",")
        if len(parts) != 2:
            raise InputError(
                "a distance and its standard deviation belong here", parameter=parameter, came=text, allowed=_WHOLE
            )
        return cls(
            quantity_si(parts[0], _LENGTHS, parameter, "200", _WHOLE),
            quantity_si(parts[1], _LENGTHS, parameter, "0.02", _WHOLE, deviation=True),
        )


def read_sockets(path: Path, apart: Apart, ball: float, sigma: float | None) -> Dataset:
    """Read a CSV with the columns ``configuration``, ``joint_1 [deg]`` .. (or ``axis_1`` ..) and ``socket``.

    Args:
        apart: What is known of the sockets.
        ball: Diameter of the ball [m].
        sigma: How well the ball comes to rest in a socket, a standard deviation of each coordinate [m]; None if that is
            not known.

    Raises:
        InputError: If there are not two sockets, or they are closer than the ball is large.
    """
    if apart.distance < ball:
        raise InputError(
            "the sockets are closer than the ball is large, so that they would run into each other",
            parameter="apart",
            came=f"{1e3 * apart.distance:.6g} mm",
            allowed=f"{1e3 * ball:.6g} mm, the diameter of the ball, or more",
            cure="Give the distance of the centres, and the diameter of the ball.",
        )
    cells = read_named(path)
    columns = columns_beside_joints(cells, _SHOWN, {})
    found = configurations_of(cells, columns)
    place, _ = columns["socket"]
    sockets = cells.texts(place)
    names = tuple(dict.fromkeys(sockets))
    if len(names) != 2:
        raise InputError(
            "two sockets are needed: their distance is the only length that is known",
            where=f"{path}, column socket",
            came=f"{len(names)}: {', '.join(names[:5])}",
            allowed="two names",
            cure="Put the ball into both sockets." if len(names) < 2 else "Correct the names, or keep two of them.",
        )
    refuse_repeated(cells, found, "Each row is a posture with the ball in one socket: give it a label of its own.")
    count = len(cells.lines)
    data = dataset_of(
        Readings(
            source=str(path),
            lines=cells.lines,
            configuration=found.of_row,
            targets=(BALL,) * count,
            reference=np.zeros(count, dtype=bool),
            position=np.zeros((count, 3)),
            sigma=None if sigma is None else np.full(count, sigma),
            fixture=sockets,
        ),
        found,
    )
    known = Dataset(
        source=str(path),
        labels=("",),
        joints=np.zeros((1, data.joints.shape[1])),
        joint_kinds=data.joint_kinds,
        targets=(names[1],),
        configuration=np.zeros(1, dtype=np.intp),
        target=np.zeros(1, dtype=np.intp),
        position=np.full((1, 3), np.nan),
        distance=np.array([apart.distance]),
        fixtures=names,
        fixture=np.zeros(1, dtype=np.intp),
        sigma=np.array([apart.sigma]),
    )
    return replace(data, setup=known)
