"""The job that plans measurements: what it takes from Python, and what its record says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tests.simulated import campaign

import truearm
from truearm.errors import InputError
from truearm.manifest import MANIFEST
from truearm.measurement.readers.canonical import csv_text
from truearm.planning.constraints.constraints import Constraints

RULES = {"truearm": "truearm-constraints/1", "units": {"length": "mm", "angle": "deg"}, "moments": {2: "positive"}}


def test_objects_and_files_give_the_same_plan(tmp_path: Path) -> None:
    _, data = campaign("irb120", 30, 0.05e-3, 1)
    file = tmp_path / "data.csv"
    file.write_text(csv_text(data))
    out = tmp_path / "plan.csv"
    from_file = truearm.plan("irb120", poses=10, candidates_from=file, out=out)
    from_data = truearm.plan(truearm.load_robot("irb120"), poses=10, candidates_from=truearm.load_data(file))
    assert np.array_equal(from_file.joints, from_data.joints)
    assert set(from_file.labels) <= set(data.labels)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["data.csv", "plan.csv", "plan.html", MANIFEST]
    assert "truearm.plan(&#39;irb120&#39;, poses=10," in (tmp_path / "plan.html").read_text()
    saved = from_data.save(tmp_path / "again.csv")
    assert saved == (tmp_path / "again.csv", tmp_path / "again.html")
    assert saved[0].read_bytes() == out.read_bytes()


def test_the_record_tells_what_constraints_cost() -> None:
    planned = truearm.plan("irb120", poses=10, candidates=60, constraints=Constraints.model_validate(RULES), seed=3)
    cost = planned.made.rejected["moment_2"]
    assert planned.lines()[0] == f"10 of {60 - cost} usable configurations, chosen by O1."
    assert f"  moment_2: broken by {cost} of 60" in planned.lines()
    assert planned.lines()[-3:] == list(planned.answer)
    assert planned.summary()["rejected"] == {"limits": 0, "moment_2": cost}


def test_a_device_and_given_candidates_do_not_go_together() -> None:
    _, data = campaign("irb120", 12, 0.05e-3, 1)
    with pytest.raises(InputError, match="a device finds its own configurations") as refusal:
        truearm.plan("irb120", poses=10, candidates_from=data, device="ballbar")
    assert refusal.value.parameter == "device, candidates_from"


def test_nothing_is_overwritten_and_the_page_has_room(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the plan is a CSV file") as refusal:
        truearm.plan("irb120", poses=10, out=tmp_path / "plan.html")
    assert refusal.value.parameter == "out"
    (tmp_path / "plan.html").mkdir()
    with pytest.raises(InputError, match="this is a folder") as refusal:
        truearm.plan("irb120", poses=10, out=tmp_path / "plan.csv")
    assert refusal.value.parameter == "out"


@pytest.mark.parametrize("poses", ["many", 0, 12.0, True])
def test_poses_are_a_whole_number_or_auto(poses: object) -> None:
    with pytest.raises(InputError) as refusal:
        truearm.plan("irb120", poses=poses)  # type: ignore[arg-type]
    assert refusal.value.parameter == "poses"


@pytest.mark.parametrize(("noise", "said"), [(1e-4, "off by 0.100 mm"), (3e-5, "off by 0.0300 mm")])
def test_a_plan_says_what_noise_it_assumes(noise: float, said: str) -> None:
    planned = truearm.plan("irb120", poses=8, candidates=30, noise=noise, seed=3)
    assert said in planned.answer[-1]
    assert "give `noise` where you know better" in planned.answer[-1]
    assert planned.answer[-1] in planned.lines()
