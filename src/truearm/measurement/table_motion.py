"""The motion of the robot's table, seen in reference points that were measured along with the targets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from truearm.measurement.checks import clean_references
from truearm.measurement.dataset import Dataset
from truearm.modeling.transform import quaternion_from_rotation, rigid_motion, rotation_from_quaternion

_UNMOVED = 1e-4  # references that keep their distances better than this moved together [m]


def without_table_motion(data: Dataset) -> Dataset:
    """Return the data as if the table had stood still.

    At each configuration with three or more reference points that kept their distances, the rigid motion from
    there to their mean places (Kabsch 1976) is applied to the readings of the targets. Other configurations stay.
    """
    points = clean_references(data)
    if points is None:
        return data
    there = np.asarray(np.isfinite(points).all(axis=2))
    complete = np.asarray(there.all(axis=1))
    if points.shape[1] < 3 or not complete.any():
        return data
    usual = points[complete].mean(axis=0)
    position, oriented = data.position.copy(), data.has_orientation
    quaternion = None if data.quaternion is None else data.quaternion.copy()
    order = np.argsort(data.configuration, kind="stable")
    first = np.searchsorted(data.configuration[order], np.arange(data.configurations + 1)).tolist()
    for c in np.flatnonzero(there.sum(axis=1) >= 3).tolist():
        seen = there[c]
        R, shift = rigid_motion(points[c, seen], usual[seen])
        misfit = np.linalg.norm(points[c, seen] @ R.T + shift - usual[seen], axis=1).max()
        if misfit > _UNMOVED:
            continue
        mine = order[first[c] : first[c + 1]]
        position[mine] = position[mine] @ R.T + shift
        if quaternion is not None:
            turned = mine[oriented[mine]]
            quaternion[turned] = quaternion_from_rotation(R @ rotation_from_quaternion(quaternion[turned]))
    return replace(data, position=position, quaternion=quaternion)
