"""Where a ChArUco board is in a camera, from pictures of it; the lens is found along with it.

Corners are found by OpenCV, and the lens by its bundle adjustment (Zhang 2000, "A Flexible New Technique for Camera
Calibration"). How well both are known follows from what the corners leave: the normal equations of all views, with the
lens eliminated or kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from truearm.errors import InputError
from truearm.files import read_bytes
from truearm.measurement.board.charuco import DICTIONARIES, Charuco
from truearm.measurement.board.views import Lens, Views
from truearm.modeling.chain import Array

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
        made = cv2.aruco.CharucoBoard((columns, rows), board.square, board.marker, names)
        corners, numbers, _, markers = cv2.aruco.CharucoDetector(made).detectBoard(image)
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
