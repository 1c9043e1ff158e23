from __future__ import annotations

from collections.abc import Iterator

import pytest

from truearm.planning.choosing import prediction


@pytest.fixture(scope="package", autouse=True)
def few_numbers_of_poses() -> Iterator[None]:
    """Judge plans at few numbers of poses: all of them take most of a plan's time, and are tested with the planning."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(prediction, "NUMBERS", (8, 30))
        yield
