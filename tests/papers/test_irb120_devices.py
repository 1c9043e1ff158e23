"""The study of instruments on the IRB 120 with small settings, and the parts it is made of."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.papers.small import medians, small, table

from papers import irb120_faro
from papers.irb120 import BETA, ELASTIC
from papers.irb120_devices.setups import (
    SETUPS,
    Truth,
    calibrate,
    driven,
    running_out,
    shares,
    twin_of,
    visible_configurations,
)
from truearm.engine.data.statistics import without_table_motion
from truearm.engine.fit.fit import identify
from truearm.engine.robot.library import load_robot
from truearm.engine.twin.truths import truth_twin


def test_the_documents_comparison() -> None:
    found = small("irb120-devices")
    before, after = medians(found, "Before calibration"), medians(found, "After calibration")
    printed = {row.what: float(row.published or "nan") for row in table(found, "After calibration").rows}
    assert before["planar artefact: mean"] == pytest.approx(4.639, rel=0.25)
    for setup in SETUPS:
        mean = f"{setup.name}, {setup.configurations} configurations: mean"
        left = after[mean]
        assert left == pytest.approx(printed[mean], rel=0.7)
        least = after[f"{setup.name}, the least run-out that Table 2.3 allows: mean"]
        lean = after[f"{setup.name}, no run-out: mean"]
        least_alone = after[f"{setup.name}, the least run-out, axes 2 and 3 parallel: mean"]
        assert least_alone < 0.7 * lean  # the angle between the axes costs more than the least run-out
        assert 0.7 * printed[mean] < lean < least < left
        assert left < 0.12 * before[f"{setup.name}: mean"]
    assert after["tracker, no compliance in the model: mean"] > 2.0 * after["tracker, 38 configurations: mean"]
    # Run-out in phase with gravity is taken for compliance.
    (compliance,) = (row for row in table(found, "Parameters that the tracker").rows if row.what == "compliance_2")
    assert compliance.median > 1.2 * float(compliance.published or "nan")
    assert len(table(found, "Tracker and cameras against").rows) == 16
    crossed = medians(found, "Calibrated with one")
    assert len(crossed) == 18
    assert max(crossed.values()) < 1.5
    ballbar = [row for of in found.tables if of.title.startswith("Ballbar") for row in of.rows]
    assert len(ballbar) == 18
    assert all(
        row.median == pytest.approx(float(row.published or 0), rel=0.8) for row in ballbar if "deviation" in row.what
    )


def test_every_instrument_and_what_closed_loops_miss() -> None:
    found = small("irb120-devices")
    few, more = medians(found, "Every instrument"), medians(found, "Three times")
    assert few["tracker: mean"] < 0.05
    assert few["point: mean"] > 5.0 * few["tracker: mean"]
    assert more["ballbar: mean"] < few["ballbar: mean"]
    lost = medians(found, "Directions")
    assert lost["ballbar: directions not seen"] == 6.0  # where the base stands
    assert lost["point: directions not seen"] == 7.0  # and the size
    assert lost["point: mean but for a change of size"] < few["point: mean"]
    assert not any(what.startswith("tracker") for what in lost)


def test_zones_and_tool() -> None:
    found = small("irb120-devices")
    zones = medians(found, "A model for each zone")
    one, four = (zones[f"geometric, 150 configurations, {cut}: mean"] for cut in ("one model", "2 x 1 x 2 zones"))
    assert four < one
    assert zones["elastic, 150 configurations, one model: mean"] < four
    tool = medians(found, "A tool calibrated alone")
    assert tool["nominal robot, 36 touches"] > 3.0 * tool["true robot, 36 touches"]
    # n touches turned evenly to all sides tell the tool to sigma sqrt(3 / n) in length, the point being unknown.
    assert tool["true robot, 36 touches"] < 3.0 * 0.05 * np.sqrt(3.0 / 36.0)
    assert len(found.pictures) == 3


def test_visibility_by_spherical_caps() -> None:
    """Directions spread evenly over the sphere would be seen by the share of the caps: the region is near to that."""
    rng = np.random.default_rng(0)
    tracker, planar, spatial = (shares(setup, 4000, rng)["of all configurations"] for setup in SETUPS)
    assert tracker == pytest.approx(100.0 * 3.0 * 0.5 * (1.0 - np.cos(np.radians(30.0))), rel=0.25)
    assert planar == pytest.approx(100.0 * (1.0 - np.cos(np.radians(15.0))), rel=0.25)
    assert spatial == 100.0


def test_seen_configurations_show_the_plate_to_the_cameras() -> None:
    planar = SETUPS[1]
    joints, _ = visible_configurations(planar, 40, np.random.default_rng(1))
    # By the twin, which stands and turns a little otherwise, and computes by another path.
    flange = Truth.of(twin_of(planar, planar.truth), joints).flange
    to_cameras = -flange[:, :3, 3] / np.linalg.norm(flange[:, :3, 3], axis=1, keepdims=True)
    lean = np.degrees(np.arccos(np.abs(np.einsum("ni,ni->n", flange[:, :3, 1], to_cameras))))
    assert lean.max() < 15.0 + 5.0  # the artefact is up to 0.16 m beside the flange, 2.6 m away


def test_without_run_out_and_lean_the_model_follows_the_twin() -> None:
    tracker = SETUPS[0]
    left = []
    for beta in (0.0, BETA):
        rng, twin = np.random.default_rng(0), twin_of(tracker, tracker.truth, "true", beta)
        truth = Truth.of(twin, visible_configurations(tracker, 40, rng)[0])
        left.append(1e3 * calibrate(tracker, twin, 100, rng).errors(truth).mean())
    assert left[0] < 0.03
    assert left[1] > 0.08


def test_the_lean_is_that_of_a_measured_arm(measured_data: Path) -> None:
    data = without_table_motion(irb120_faro.measured(measured_data / "irb120-faro"))
    robot = identify(load_robot("irb120").with_payload(irb120_faro.PAYLOAD), data, ELASTIC).robot
    assert robot.values["beta_3"] == pytest.approx(BETA, abs=np.radians(0.001))


def test_run_out_turns_each_joint_by_its_sine() -> None:
    nominal = driven()
    twin = running_out(truth_twin(nominal, "nominal", np.random.default_rng(0)))
    joints = nominal.random_configurations(4, np.random.default_rng(2))
    amplitude = np.array([0.004, 0.032, 0.028, 0.044, 0.049, 0.061])
    phase = np.array([150.0, 0.0, 195.0, 315.0, 270.0, 210.0])
    turned = joints + np.radians(amplitude) * np.sin(joints + np.radians(phase))
    stiff = replace(twin, joints={number: replace(j, compliance=0.0) for number, j in twin.joints.items()})
    found = Truth.of(stiff, joints).places((0.0, 0.0, 0.1))
    plain = twin.robot.with_frames(twin.robot.base, {"tip": (0.0, 0.0, 0.1)})
    assert found == pytest.approx(plain.world_poses(turned, "tip")[0], abs=1e-12)
