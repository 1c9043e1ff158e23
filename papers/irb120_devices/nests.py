"""Tracker and cameras against a coordinate measuring machine (Nubiola, 2.6.1): distance errors of nests, Table 2.5."""

from __future__ import annotations

from typing import Final

import numpy as np

from papers.irb120_devices.setups import Setup
from truearm.engine.robot.chain import Array
from truearm.engine.robot.transform import rigid_motion, rotation_from_vector

#: The four nests on the granite, the last of which is not in the common frame, and where the artefact stood among them
#: [m]: invented, no distance is printed.
_GRANITE: Final = np.array([[-0.2, -0.2, 0.0], [0.2, -0.2, 0.0], [0.2, 0.2, 0.0], [-0.2, 0.2, 0.0]])
_ARTEFACT: Final = np.array([0.0, 0.0, 0.1])


def nest_errors(setup: Setup, sigma: float, size: float | None, rng: np.random.Generator) -> Array:
    """Return how far the nests 1 to 4 are from where the measuring machine has them [m], ``(4,)``.

    Args:
        setup: Gives the nests on the artefact.
        sigma: Standard deviation of a coordinate that is read [m].
        size: What turns it into one of the artefact's turns [m]; None where each nest is read for itself.
        rng: Of the readings.
    """
    true = np.concatenate([np.array([*setup.nests.values()]) + _ARTEFACT, _GRANITE])
    if size is None:
        read = true + rng.normal(0.0, sigma, true.shape)
    else:
        turn = rotation_from_vector(rng.normal(0.0, sigma / size, 3))
        on_artefact = true[:3] @ turn.T + rng.normal(0.0, sigma, 3)
        read = np.concatenate([on_artefact, true[3:] + rng.normal(0.0, sigma, (4, 3))])
    R, t = rigid_motion(read[3:6], true[3:6])
    apart = read @ R.T + t - true
    return np.asarray(np.linalg.norm(apart[[0, 1, 2, 6]], axis=1))
