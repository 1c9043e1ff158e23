"""Where a ChArUco board is in a camera, from pictures of it; the lens is found along with it.

Corners are found by OpenCV, and the lens by its bundle adjustment (Zhang 2000, "A Flexible New Technique for Camera
Calibration"). How well both are known follows from what the corners leave: the normal equations of all views, with the
lens eliminated or kept.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from truearm.engine.base.errors import InputError, did_you_mean
from truearm.engine.base.files import read_bytes
from truearm.engine.base.units import quantity_si
from truearm.engine.robot.chain import Array

#: Dictionaries of markers, as OpenCV names them behind ``DICT_``, and how many markers each has.
DICTIONARIES: Final[dict[str, int]] = {
    f"{bits}X{bits}_{count}": count for bits in (4, 5, 6, 7) for count in (50, 100, 250, 1000)
} | {"ARUCO_ORIGINAL": 1024, "APRILTAG_16h5": 30, "APRILTAG_25h9": 35, "APRILTAG_36h10": 2320, "APRILTAG_36h11": 587}
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


@dataclass(frozen=True, eq=False)
class Lens:
    """What pictures say of a camera's lens: pinhole and distortion, in the model of OpenCV."""

    #: values, deviations: ``fx``, ``fy``, ``cx``, ``cy`` [px] and ``k1``, ``k2``, ``p1``, ``p2``, ``k3``, and their
    #: standard deviations.
    values: Mapping[str, float]
    deviations: Mapping[str, float]
    noise: float  #: Standard deviation of a coordinate of a corner, by what the corners leave [px].
    corners: tuple[int, ...]  #: How many corners were seen in each picture, ``(pictures,)``.


@dataclass(frozen=True, eq=False)
class Views:
    """Where a board is in a camera, view by view."""

    rotation: Array  #: rotation, position: ``T_camera_board``: ``(n, 3, 3)`` and ``(n, 3)`` [m].
    position: Array
    #: Possible errors of each view that belong to no other view, as columns of a small turn in the camera's axes [rad]
    #: and a shift [m], ``(n, 6, k)``: their squares add up. None if nothing is known.
    spread: Array | None = None
    #: Errors that one unknown makes in all views at once, ``(n, 6, m)``: those of the lens, a deviation each.
    common: Array = field(default_factory=lambda: np.zeros((0, 6, 0)))
    lens: Lens | None = None  #: Of the camera, where pictures were read.

    def point_ahead(self) -> float:
        """Return how far before the camera the board was on average [m]."""
        return float(self.position[:, 2].mean())

    def camera_in_board(self, ahead: float) -> tuple[Array, Array, Array | None, Array | None]:
        """Return where a point on the camera's axis is, seen from the board, and how the camera is turned there.

        A small turn of the board hardly moves the point that lies where the board is: the error of the place is then
        nearly independent of that of the orientation, which it is not for the camera itself.

        Args:
            ahead: How far the point is before the camera [m].

        Returns:
            Places ``(n, 3)``, rotations ``(n, 3, 3)``, and the standard deviations of a coordinate of the places
            ``(n,)`` and of a turn about an axis ``(n,)``, or None.
        """
        lever = np.array([0.0, 0.0, ahead]) - self.position
        turned = np.swapaxes(self.rotation, 1, 2)
        places = np.einsum("nij,nj->ni", turned, lever)
        return places, turned, *self._deviations(lever)

    def board_in_camera(self) -> tuple[Array, Array, Array | None, Array | None]:
        """Return where the board is in the camera, as :meth:`camera_in_board` does."""
        return self.position, self.rotation, *self._deviations(np.zeros_like(self.position))

    def _deviations(self, lever: Array) -> tuple[Array | None, Array | None]:
        """Return deviations of places at levers from the board ``(n, 3)``, and of orientations.

        Errors of the lens that are the same in every view, seen from the camera, are no errors: where the camera is
        on the flange, or stands, is found anyway. What differs is taken for independent from view to view.
        """
        if self.spread is None:
            return None, None
        errors = self.spread
        if self.common.shape[2]:
            errors = np.concatenate([errors, self.common - self.common.mean(axis=0)], axis=2)
        turn, shift = errors[:, :3], errors[:, 3:]
        moved = shift + np.cross(turn, lever[:, :, None], axis=1)
        return np.sqrt(np.sum(moved**2, axis=(1, 2)) / 3.0), np.sqrt(np.sum(turn**2, axis=(1, 2)) / 3.0)


def of_deviations(rotation: Array, position: Array, sigma: Array | None, sigma_rot: Array | None) -> Views:
    """Return views whose deviations are known as one number for places [m] and one for turns [rad], ``(n,)``."""
    if sigma is None or sigma_rot is None:
        return Views(rotation, position)
    spread = np.zeros((len(position), 6, 6))
    spread[:, range(3), range(3)] = sigma_rot[:, None]
    spread[:, range(3, 6), range(3, 6)] = sigma[:, None]
    return Views(rotation, position, spread)


#: Corners that a picture must show: with fewer a pose is hardly determined.
LEAST_CORNERS: Final = 8
#: Pictures without which a lens is hardly determined.
LEAST_PICTURES: Final = 8
#: Corners that miss their places by more than this on average are those of another board, or of a moving one [px].
_MOST_OFF: Final = 3.0
_LENS: Final = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")

Seen = tuple[Array, Array]


def seen_in_pictures(pictures: Sequence[Path], board: Charuco) -> Views:
    """Return where a board is in the camera that took some pictures.

    Args:
        pictures: Of one camera with one lens, all of one size.

    Raises:
        InputError: If OpenCV is not installed, a picture does not show the board or is of another size, or the corners
            do not fit the board.
    """
    cv2 = _opencv()
    if len(pictures) < LEAST_PICTURES:
        raise InputError(
            "too few pictures to know the lens",
            where=str(pictures[0].parent) if pictures else None,
            came=len(pictures),
            allowed=f"{LEAST_PICTURES} or more",
            cure="Take more, from all sides of the board.",
        )
    size, seen = None, list[Seen]()
    for path in pictures:
        image = _image(cv2, path)
        if size is not None and image.shape != size:
            raise InputError(
                "the pictures are not of one size",
                where=str(path),
                came=f"{image.shape[1]} x {image.shape[0]} px",
                allowed=f"{size[1]} x {size[0]} px, as {pictures[0].name}",
                cure="Use pictures of one camera as it took them, not cropped or scaled.",
            )
        size = image.shape
        seen.append(_corners(cv2, image, board, path))
    return _fitted(cv2, seen, (size or (0, 0))[::-1], pictures)


def _opencv() -> Any:
    try:
        import cv2
    except ImportError as error:
        raise InputError(
            "pictures are read by OpenCV, and it is not installed",
            cure='Install it with truearm: pip install "truearm[vision]".',
        ) from error
    return cv2


def _image(cv2: Any, path: Path) -> Any:
    """Return a picture in grey, ``(rows, columns)``."""
    image = cv2.imdecode(np.frombuffer(read_bytes(path), np.uint8), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise InputError("this is no picture", where=str(path), allowed="PNG, JPEG, TIFF or BMP")
    return image


def _corners(cv2: Any, image: Any, board: Charuco, path: Path) -> Seen:
    """Return the corners that a picture shows [px], ``(k, 2)``, and where they are on the board [m], ``(k, 3)``."""
    names = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{board.dictionary}"))

    def detected(columns: int, rows: int) -> tuple[Any, Any, int, int]:
        charuco = cv2.aruco.CharucoBoard((columns, rows), board.square, board.marker, names)
        corners, numbers, _, markers = cv2.aruco.CharucoDetector(charuco).detectBoard(image)
        return corners, numbers, 0 if numbers is None else len(numbers), 0 if markers is None else len(markers)

    corners, numbers, count, many = detected(board.columns, board.rows)
    if count >= LEAST_CORNERS:
        return np.asarray(corners, float).reshape(-1, 2), board.places[np.asarray(numbers).ravel()]
    mirrored = _markers(cv2, np.ascontiguousarray(image[:, ::-1]), board.dictionary)
    if mirrored >= max(LEAST_CORNERS, 2 * many):  # a few are taken for others as they are
        raise InputError(
            "this picture is mirrored",
            where=str(path),
            came=f"markers of {board.dictionary} in its mirror image",
            cure="Switch off mirroring in the camera's software, and take the pictures anew or mirror them back.",
        )
    if many and board.columns != board.rows and detected(board.rows, board.columns)[2] >= LEAST_CORNERS:
        raise InputError(
            "columns and rows of the board are exchanged",
            where=str(path),
            came=f"{board.columns}x{board.rows}",
            allowed=f"{board.rows}x{board.columns}",
            cure="Count the squares along the edge on which the markers' numbers go up by one first.",
        )
    if many:
        raise InputError(
            "too few corners of the board are seen",
            where=str(path),
            came=f"{count} corners, {many} markers",
            allowed=f"{LEAST_CORNERS} corners or more",
            cure="Leave the picture out, or take it anew; if all are like it, it is another board than was named.",
        )
    others = [name for name in DICTIONARIES if name != board.dictionary and _markers(cv2, image, name) >= LEAST_CORNERS]
    if others:
        raise InputError(
            "this is another board: its markers are of another dictionary",
            where=str(path),
            came=others[0],
            allowed=board.dictionary,
            cure="Name the board that is in the pictures.",
        )
    raise InputError(
        "the board is not seen in this picture",
        where=str(path),
        allowed=f"markers of {board.dictionary}",
        cure="Leave the picture out, or take it anew.",
    )


def _markers(cv2: Any, image: Any, dictionary: str) -> int:
    """Return how many markers of a dictionary a picture shows."""
    markers = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{dictionary}"))
    return len(cv2.aruco.ArucoDetector(markers).detectMarkers(image)[0])


def _fitted(cv2: Any, seen: Sequence[Seen], size: tuple[int, int], pictures: Sequence[Path]) -> Views:
    """Return the views, and the lens, that fit corners best."""
    objects = [places.astype(np.float32) for _, places in seen]
    images = [corners.astype(np.float32) for corners, _ in seen]
    _, K, distortion, turns, shifts = cv2.calibrateCamera(objects, images, size, None, None)
    distortion = np.ravel(distortion)[:5]
    rotations = np.array([cv2.Rodrigues(turn)[0] for turn in turns])
    positions = np.array([np.ravel(shift) for shift in shifts])
    poses, lens, off = [], [], []
    for (corners, places), turn, shift, R in zip(seen, turns, shifts, rotations, strict=True):
        predicted, J = cv2.projectPoints(places, turn, shift, K, distortion)
        by_place = J[:, 3:6].reshape(-1, 2, 3)
        arm = places @ R.T
        by_turn = np.cross(arm[:, None, :], by_place)  # the derivative of w x arm, with one row a coordinate
        poses.append(np.concatenate([by_turn, by_place], axis=2).reshape(-1, 6))
        lens.append(J[:, 6:15])
        off.append((predicted.reshape(-1, 2) - corners).ravel())
    squares = np.array([float(r @ r) for r in off])
    rows = np.array([len(r) for r in off])
    worst = int(np.argmax(squares / rows))
    if squares[worst] > _MOST_OFF**2 * rows[worst]:
        raise InputError(
            "the corners do not fit the board: it is another board, bent, or was moving",
            where=str(pictures[worst]),
            came=f"{np.sqrt(squares[worst] / rows[worst]):.1f} px",
            allowed=f"{_MOST_OFF:g} px or less",
            cure="Check the squares and the dictionary of the board; leave the picture out if it alone is like this.",
        )
    noise = float(np.sqrt(squares.sum() / max(rows.sum() - 6 * len(rows) - len(_LENS), 1)))
    return _known(rotations, positions, poses, lens, noise, K, distortion, [r // 2 for r in rows.tolist()])


def _known(
    rotations: Array,
    positions: Array,
    poses: Sequence[Array],
    lens: Sequence[Array],
    noise: float,
    K: Array,
    distortion: Array,
    corners: Sequence[int],
) -> Views:
    """Return the views with what is not known of each, and of all through the lens.

    Args:
        poses, lens: Derivative of the corners of each view by its pose, ``(rows, 6)``, and by the lens, ``(rows, 9)``.
    """
    spread, by_lens, left = [], [], np.zeros((len(_LENS), len(_LENS)))
    for J, L in zip(poses, lens, strict=True):
        inverse = np.linalg.inv(J.T @ J)
        taken = inverse @ (J.T @ L)
        spread.append(noise * np.linalg.cholesky(inverse))
        by_lens.append(-taken)
        left += L.T @ (L - J @ taken)
    scale = 1.0 / np.sqrt(np.diag(left))
    covariance = noise**2 * np.linalg.pinv(left * np.outer(scale, scale), rcond=1e-12) * np.outer(scale, scale)
    values = (K[0, 0], K[1, 1], K[0, 2], K[1, 2], *distortion)
    w, V = np.linalg.eigh(covariance / np.outer(scale, scale))
    root = scale[:, None] * (V * np.sqrt(np.maximum(w, 0.0)))
    return Views(
        rotations,
        positions,
        np.array(spread),
        np.array(by_lens) @ root,
        Lens(
            dict(zip(_LENS, map(float, values), strict=True)),
            dict(zip(_LENS, np.sqrt(np.diag(covariance)).tolist(), strict=True)),
            noise,
            tuple(corners),
        ),
    )
