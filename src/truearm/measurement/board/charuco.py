"""A ChArUco board as a text names it: ``14x10,25mm,18mm,5X5_250``."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.errors import InputError, did_you_mean
from truearm.modeling.chain import Array
from truearm.units import quantity_si

#: Dictionaries of markers, as OpenCV names them behind ``DICT_``, and how many markers each has.
DICTIONARIES: Final[dict[str, int]] = {
    f"{bits}X{bits}_{count}": count for bits in (4, 5, 6, 7) for count in (50, 100, 250, 1000)
} | {
    "ARUCO_ORIGINAL": 1024,
    "APRILTAG_16h5": 30,
    "APRILTAG_25h9": 35,
    "APRILTAG_36h10": 2320,
    "APRILTAG_36h11": 587,
}
_WHOLE: Final = "14x10,25mm,18mm,5X5_250"
_MOST: Final = 100


@dataclass(frozen=True)
class Charuco:
    """A chessboard with a marker in every white square."""

    columns: int  #: columns, rows: squares along x and y.
    rows: int
    square: float  #: square, marker: side of a square, and of a marker [m].
    marker: float
    dictionary: str  #: Of the markers, one of :data:`DICTIONARIES`.

    @classmethod
    def of_text(cls, text: str, parameter: str = "board") -> Charuco:
        """Return the board that a text such as ``14x10,25mm,18mm,5X5_250`` names."""
        parts = [part.strip() for part in text.split(",")]
        counts = re.fullmatch(r"([0-9]{1,4})[xX]([0-9]{1,4})", parts[0])
        if len(parts) != 4 or counts is None:
            raise InputError(
                "a board is its squares, the sides of a square and of a marker, and the dictionary",
                parameter=parameter,
                came=text,
                allowed=_WHOLE,
            )
        columns, rows = int(counts[1]), int(counts[2])
        if not 3 <= min(columns, rows) <= max(columns, rows) <= _MOST:
            raise InputError(
                "a board has squares in several rows",
                parameter=parameter,
                came=parts[0],
                allowed=f"3x3 to {_MOST}x{_MOST}",
            )
        square, marker = (
            quantity_si(part, ("mm", "m", "um", "in"), parameter, number, _WHOLE)
            for part, number in ((parts[1], "25"), (parts[2], "18"))
        )
        if not 0.0 < marker < square:
            raise InputError(
                "a marker is smaller than the square around it",
                parameter=parameter,
                came=f"{parts[1]},{parts[2]}",
                allowed="square, then marker, both above 0",
            )
        dictionary = parts[3].removeprefix("DICT_")
        if dictionary not in DICTIONARIES:
            raise InputError(
                "there is no such dictionary of markers",
                parameter=parameter,
                came=parts[3],
                allowed=", ".join(DICTIONARIES),
                cure=did_you_mean(dictionary, DICTIONARIES),
            )
        if columns * rows // 2 > DICTIONARIES[dictionary]:
            raise InputError(
                "the dictionary has fewer markers than the board",
                parameter=parameter,
                came=f"{columns * rows // 2} markers of {dictionary}",
                allowed=f"{DICTIONARIES[dictionary]} or fewer",
                cure="Correct the squares, or the dictionary.",
            )
        return cls(columns, rows, square, marker, dictionary)

    @property
    def corners(self) -> int:
        """How many corners between squares it has."""
        return (self.columns - 1) * (self.rows - 1)

    @property
    def places(self) -> Array:
        """Where they are, counted from the middle of the board, row by row [m], ``(corners, 3)``."""
        x, y = np.meshgrid(np.arange(1, self.columns), np.arange(1, self.rows))
        middle = np.array([self.columns, self.rows]) / 2
        flat = (np.column_stack([x.ravel(), y.ravel()]) - middle) * self.square
        return np.column_stack([flat, np.zeros(len(flat))])
