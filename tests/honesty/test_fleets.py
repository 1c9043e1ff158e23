"""What changed in robots that were measured again is told, and not what their temperature does."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from tests.honesty.telling import Told, told, written

from truearm.engine.robot.library import load_robot
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import measure
from truearm.engine.twin.twin_joint import PERFECT

NOISE = 2e-5
#: Of steel [1/K].
STEEL = 11.5e-6


@dataclass(frozen=True)
class July:
    """What differs half a year later.

    Attributes
    ----------
    warmer, recorded
        By how much the arm is [K], and whether the data say so.
    slipped, worn
        By how much the zero of joint 3 moved [deg], and how much longer link 3 is [mm].
    unit
        How much longer than before the instrument reads lengths, a factor.
    """

    warmer: float = 0.0
    recorded: bool = False
    slipped: float = 0.0
    worn: float = 0.0
    unit: float = 1.0


def fleet(folder: Path, july: July) -> Told:
    """Measure a machine in January and in July, and analyse it as a fleet."""
    nominal, rng = load_robot("irb120"), np.random.default_rng(0)
    twin = truth_twin(nominal, "random", rng)
    joints = {number: replace(twin.joints.get(number, PERFECT), growth=STEEL) for number in range(1, 7)}
    values = twin.robot.values
    later = {
        "theta_offset_3": values["theta_offset_3"] + np.radians(july.slipped),
        "a_3": values["a_3"] + july.worn / 1e3,
    }
    rows = ["name,robot,data,of,date"]
    for month, warmer, changes, unit in ((1, 0.0, {}, 1.0), (7, july.warmer, later, july.unit)):
        robot = replace(twin, robot=twin.robot.with_values({**values, **changes}), joints=joints)
        q = nominal.random_configurations(40, rng)
        data = measure(robot, q, NOISE, rng, temperature=np.full(len(q), 20.0 + warmer))
        data = replace(data, position=data.position * unit)
        written(folder, data if july.recorded else replace(data, temperature=None), f"{month}.csv")
        rows.append(f"m{month},irb120,{month}.csv,4711,2026-{month:02d}-05")
    (folder / "robots.csv").write_text("\n".join(rows) + "\n", "utf-8")
    manifest = "truearm: truearm-fleet/1\nrobots: robots.csv\noptions: {model: geometric}\n"
    (folder / "fleet.yaml").write_text(manifest, "utf-8")
    return told("fleet", folder / "fleet.yaml", "--out", folder / "out", "--workers", 1)


def changed(found: Told) -> set[str]:
    """Return the parameters that changed by more than chance."""
    (kind,) = found.summary["kinds"]
    return {drift["parameter"] for drift in kind["drift"] if drift["significant"]}


@pytest.mark.parametrize("recorded", [True, False])
def test_a_warmer_robot_has_not_changed(recorded: bool, tmp_path: Path) -> None:
    found = fleet(tmp_path, July(warmer=15.0, recorded=recorded))
    assert not changed(found)
    assert "robots-drift" not in found.levels
    (grown,) = found.summary["kinds"][0]["grown"]
    assert (grown["machine"], grown["ppm"]) == ("4711", pytest.approx(1e6 * STEEL * 15.0, abs=40.0))
    assert "4711: all lengths grew by" in (tmp_path / "out" / "report.html").read_text("utf-8")
    assert grown["warmer_k"] == (pytest.approx(15.0) if recorded else None)


@pytest.mark.parametrize(
    ("july", "parameters"),
    [
        (July(warmer=15.0, slipped=0.05), {"theta_offset_3"}),
        (July(worn=0.15), {"a_3"}),
        (July(warmer=15.0, recorded=True, slipped=0.05), {"theta_offset_3"}),
        (July(recorded=True, unit=1.0003), {"a_3", "d_4"}),  # as warm as before: nothing made it grow
    ],
    ids=["zero", "one length", "zero, temperature known", "instrument"],
)
def test_what_no_temperature_does_is_told(july: July, parameters: set[str], tmp_path: Path) -> None:
    found = fleet(tmp_path, july)
    assert parameters <= changed(found)
    assert parameters == changed(found) or july.unit != 1.0
    assert found.says("robots-drift", "warning", "1 machine changed")
    assert bool(found.summary["kinds"][0]["grown"]) == (july.warmer > 0.0)
