"""Joint positions that stand twice in a campaign."""

from __future__ import annotations

import numpy as np
import pytest

from truearm.engine.data.dataset import Dataset
from truearm.engine.data.thinning import repeated_joints


def test_joints_copied_many_times_are_found_without_comparing_every_pair(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(1)
    postures, visits, targets = 40, 25, 3
    posture = np.tile(np.arange(postures), visits)
    far = rng.random(len(posture)) < 0.1
    far[:postures] = False
    position = rng.normal(size=(postures, targets, 3))[posture] + 1e-5 * rng.normal(size=(len(posture), targets, 3))
    position[far, rng.integers(targets, size=len(posture))[far], 0] += 0.02
    rows = rng.permutation(len(posture) * targets)  # a table need not be sorted
    data = Dataset(
        source="many.csv",
        labels=tuple(f"{c}" for c in range(len(posture))),
        joints=rng.uniform(-1, 1, size=(postures, 6))[posture],
        joint_kinds=("revolute",) * 6,
        targets=("A", "B", "C"),
        configuration=np.repeat(np.arange(len(posture)), targets)[rows],
        target=np.tile(np.arange(targets), len(posture))[rows],
        position=position.reshape(-1, 3)[rows],
    )
    compared: list[int] = []
    norm = np.linalg.norm

    def counted(values: np.ndarray, axis: int) -> np.ndarray:
        compared.append(len(values))
        return np.asarray(norm(values, axis=axis))

    monkeypatch.setattr(np.linalg, "norm", counted)
    assert repeated_joints(data) == [(f"{posture[c]}", f"{c}") for c in np.flatnonzero(far)]
    assert sum(compared) == len(rows)
