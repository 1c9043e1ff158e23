"""Arms whose links may lie beside the lines of the model."""

from __future__ import annotations

import pytest

from truearm import load_robot
from truearm.planning.driving.links_beside import beside_notices, links_beside


@pytest.mark.parametrize(("name", "length"), [("ur5e", 0.1333), ("ur3e", 0.13105), ("ur10", 0.163941)])
def test_three_parallel_axes_lead_along_themselves(name: str, length: float) -> None:
    ((joints, along),) = links_beside(load_robot(name))
    assert joints == (2, 3, 4)
    assert along == pytest.approx(length)


@pytest.mark.parametrize("name", ["irb120", "gp7", "lrmate200id"])
def test_links_in_one_plane_lie_on_their_lines(name: str) -> None:
    assert not beside_notices(load_robot(name))


def test_the_stated_distance_is_not_claimed_of_links_beside() -> None:
    (notice,) = beside_notices(load_robot("ur5e"))
    assert (notice.code, notice.level) == ("links-beside", "warning")
    assert "joints 2, 3 and 4" in notice.message
    assert "133 mm" in notice.message
