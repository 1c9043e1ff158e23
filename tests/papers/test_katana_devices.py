"""The study katana-devices: instruments on a Katana twin, and the page that the twin draws on."""

from __future__ import annotations

import numpy as np
import pytest
from tests.papers.small import row, small

from papers.katana.robot import katana
from papers.katana_devices import together
from papers.katana_devices.page import OnPage
from papers.katana_devices.setup import USED
from papers.study import Study
from truearm.engine.data.observations import compared
from truearm.engine.twin.devices import named_device
from truearm.engine.twin.devices.device import measured_with
from truearm.engine.twin.twin import Twin


@pytest.fixture(scope="module")
def found() -> Study:
    return small("katana-devices")


def test_every_device_is_in_both_tables(found: Study) -> None:
    tables = {table.title: table for table in found.tables}
    for start in ("geometry alone", "tilting first"):
        rows = tables[f"Every device, {start}"].rows
        assert [one.what.partition(",")[0] for one in rows[1:-1]] == [device.name for device in USED]
        assert all(np.isfinite(one.median) for one in rows)


def test_tilting_is_worth_more_than_the_instrument(found: Study) -> None:
    left = {
        (start, what): row(found, f"Every device, {start}", f"{what}, 16 configurations, mean").median
        for start in ("geometry alone", "tilting first")
        for what in ("markers", "measurement-arm", "two-spheres")
    }
    for what in ("markers", "measurement-arm", "two-spheres"):
        assert left["tilting first", what] < 0.5 * left["geometry alone", what]


def test_closed_loops_say_what_they_do_not_see(found: Study) -> None:
    table = "What closed loops do not see"
    assert row(found, table, "five-lasers: directions that it does not see").median == 6
    assert row(found, table, "point: directions that it does not see").median == 7
    plane = row(found, table, "plane: directions that it does not see")
    assert "where the robot stands and how large it is" in plane.explanation


def test_the_page_shows_a_part_of_the_true_error(found: Study) -> None:
    table = "The circle of section 5.5.1 on the page"
    seen, moved, true = (
        row(found, table, f"before: {what}").median
        for what in ("as the page shows it", "after the best rigid motion", "true mean distance")
    )
    assert 0.02 < seen < moved + 0.03 < true
    after = row(found, table, "markers, tilting first: true mean distance").median
    assert after < 0.3 * true
    assert "Plotly" in found.html()


def test_what_the_page_shows_is_outward_and_upward() -> None:
    three = np.array([3e-1, 0.0])
    page = OnPage(along=np.zeros(2), outward=three, height=np.array([4e-1, 0.0]), distance=three, moved=three)
    assert page.shown == pytest.approx(0.25)


def test_two_campaigns_together_keep_every_reading() -> None:
    robot = Twin(katana().with_frames(katana().base, {"pencil": (0.0, 0.0, 0.13)}))
    rng = np.random.default_rng(0)
    parts = [measured_with(named_device(name), katana(), robot, 8, rng) for name in ("touch-up", "drawn-circle")]
    both = together(*parts)
    assert both.configurations == 16
    assert both.joints == pytest.approx(np.concatenate([part.joints for part in parts]))
    read = [[(fixture, kind.name, len(r)) for _, fixture, kind, r in compared(data)] for data in (both, *parts)]
    assert read[0] == [*read[1], *read[2]]
    assert both.setup is parts[1].setup
