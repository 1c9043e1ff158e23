"""Poses of a board in a camera, with what is not known of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from truearm.modeling.chain import Array


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
