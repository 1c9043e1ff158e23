"""Cups and legs of the hexapod: which distances it has, and between which cups its six legs go (Nubiola, 3.2).

The base fixture and the tool fixture carry three cups each, B1 to B3 and T1 to T3. A design says which of them are
joined by the six legs: one base cup has two legs, the next three, the last one, so that one tool cup after the other
can be found (:mod:`truearm.measurement.hexapod.kinematics`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.modeling.chain import Array

#: Three cups of a fixture in some order, counted from 0.
Order = tuple[int, int, int]
#: Ends of the three distances of a fixture, in the order in which they are given everywhere: 12, 23, 31.
SIDES: Final = ((0, 1), (1, 2), (2, 0))
#: How thin a triangle may be: its height over its longest side.
_THINNEST: Final = 1e-4


@dataclass(frozen=True)
class Device:
    """Lengths of the device as it is built, and its ballbar; the defaults are Nubiola's with a Renishaw QC20-W."""

    #: base, tool, leg: nominal distance between two cups of the base, of the tool, and between base and tool [m].
    base: float = 0.300
    tool: float = 0.150
    leg: float = 0.300
    reach: float = 1e-3  #: How far a length may be from its nominal one to be measured [m].
    sigma: float = 1e-6 / 1.96  #: Standard deviation of a measured length [m]: 1 um in 95 of 100 readings.

    def check(self, nominal: float, length: float, between: str, where: str | None = "ballbar") -> None:
        """Refuse a length that the ballbar cannot have read.

        Args:
            nominal, length: [m].
            between: The two cups, as ``B1-T2``.
            where: For the message; None where a job's parameter says enough.
        """
        if not abs(length - nominal) <= self.reach * (1 + 1e-9):
            raise InputError(
                f"the length {between} is beyond the range of the ballbar",
                where=where,
                came=f"{length * 1e3:.4f} mm",
                allowed=f"{nominal * 1e3:g} mm +/- {self.reach * 1e3:g} mm",
                cure="Check that the bar was between these two cups. Leave out a pose that cannot be measured.",
            )


DEVICE: Final = Device()


@dataclass(frozen=True)
class Design:
    """Which cups the six legs join."""

    base: Order  #: The base cups with two legs, with three, and with one.
    tool: Order  #: The tool cups found first (three legs), second (two legs) and third (one leg).

    @property
    def legs(self) -> tuple[tuple[int, int], ...]:
        """Base cup and tool cup of each leg: three to the first tool cup, two to the second, one to the third."""
        (i, j, k), (first, second, third) = self.base, self.tool
        return (i, first), (j, first), (k, first), (i, second), (j, second), (j, third)

    @property
    def leg_names(self) -> tuple[str, ...]:
        """The legs as ``B1-T2``."""
        return tuple(f"B{base + 1}-T{tool + 1}" for base, tool in self.legs)

    @property
    def name(self) -> str:
        """The design as the document writes it, ``112212331``: base 1 to tool 1 2, base 2 to 1 2 3, base 3 to 1."""
        (i, j, k), (first, second, third) = ([n + 1 for n in order] for order in (self.base, self.tool))
        return f"{i}{first}{second}{j}{first}{second}{third}{k}{first}"


def designs() -> tuple[Design, ...]:
    """Return all designs: every order of the base cups with every order of the tool cups."""
    orders = tuple(permutations((0, 1, 2)))
    return tuple(Design(base, tool) for base in orders for tool in orders)  # type: ignore[arg-type]


def handedness(order: Order) -> int:
    """Return 1 for an order that goes round as 1 2 3 does, -1 for one that goes the other way."""
    return 1 if order in ((0, 1, 2), (1, 2, 0), (2, 0, 1)) else -1


def side_names(fixture: str) -> tuple[str, str, str]:
    """Return the names of the three distances of fixture ``B`` or ``T``, as ``B1-B2``."""
    a, b, c = (f"{fixture}{i + 1}-{fixture}{j + 1}" for i, j in SIDES)
    return a, b, c


def triangle(sides: Sequence[float] | Array, fixture: str) -> Array:
    """Return the cups of a fixture in its own frame from its distances 12, 23 and 31.

    The first cup is the origin, the second lies on x, the third at positive y (Nubiola, 4.6 and 4.7).

    Args:
        sides: [m], ``(3,)`` or ``(3, n)``.
        fixture: ``B`` or ``T``, for messages.

    Returns:
        cups: ``(cup, 3)`` or ``(cup, 3, n)``.

    Raises:
        InputError: If the distances are not those of a triangle, or the three cups lie on one line.
    """
    d12, d23, d31 = (np.asarray(side, float) for side in sides)
    lengths = np.array(np.broadcast_arrays(d12, d23, d31)).reshape(3, -1)
    with np.errstate(divide="ignore", invalid="ignore"):  # two cups in one place
        x = (lengths[0] ** 2 + lengths[2] ** 2 - lengths[1] ** 2) / (2 * lengths[0])
    height = lengths[2] ** 2 - x**2
    flat = np.flatnonzero(~(height > (_THINNEST * lengths.max(axis=0)) ** 2))
    if len(flat):
        names, worst = side_names(fixture), lengths[:, flat[0]]
        longest = names[int(np.argmax(worst))]
        raise InputError(
            f"the cups {', '.join(f'{fixture}{n + 1}' for n in range(3))} lie on one line, or no triangle has these "
            "distances",
            where=longest,
            came=", ".join(f"{name} {length * 1e3:.3f} mm" for name, length in zip(names, worst, strict=True)),
            allowed="three distances of a triangle, each well below the sum of the others",
            cure=f"Measure {longest} again.",
        )
    zero = np.zeros_like(x)
    cups = np.array([[zero, zero, zero], [lengths[0], zero, zero], [x, np.sqrt(height), zero]])
    shape = np.broadcast_shapes(d12.shape, d23.shape, d31.shape)
    return cups.reshape(3, 3, *shape)
