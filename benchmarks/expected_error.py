"""Holds the error to expect over the workspace against the true one of simulated robots.

An IRB 120 is measured within a few degrees of one posture, calibrated, and judged at 300 configurations of its full
range. Others are measured over their full range, with joints that repeat to so many degrees, or by devices that do not
locate the robot: then the true error is that behind the best rigid motion. Arguments: robots for each
case (40, three times as many where the truth is drawn from the priors as they are) and full-range campaigns (100).
Writes benchmarks/expected_error.json.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.diagnose.expected_error import expected_error
from truearm.engine.diagnose.narrow_data import check_narrow_data
from truearm.engine.diagnose.position_errors import as_residuals_allow
from truearm.engine.fit.fit import Status, identify
from truearm.engine.fit.models import named_model
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import rigid_motion
from truearm.engine.twin.devices import named_device
from truearm.engine.twin.devices.device import in_view_of, measured_with, seen_by
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure

CENTRE = np.array([10.0, 20.0, 10.0, 20.0, 40.0, 10.0])
WIDTHS = (1.0, 5.0, 15.0, 40.0, None)
SCALES = (1.0, 0.3, 3.0)
REPEATABILITIES = (0.005, 0.02)
POSES, NOISE, JUDGED = 60, 0.02e-3, 300
#: Configurations of a campaign of few, with repeatability.
FEW = 14
#: Devices, with configurations of their campaigns.
LOOPS = (
    ("point", 60),
    ("point", 100),
    ("point", 300),
    ("plane", 60),
    ("two-sockets", 60),
    ("two-sockets", 100),
    ("ballbar", 60),
    ("strings", 60),
)
GEOMETRIC = named_model("geometric")
nominal = load_robot("irb120")


def narrowed(width: float | None) -> Robot:
    """Return the robot with limits of `width` degrees about the centre; its own without."""
    if width is None:
        return nominal
    about = zip(np.radians(CENTRE - width).tolist(), np.radians(CENTRE + width).tolist(), strict=True)
    limits = [
        (max(low, j.limits[0]), min(high, j.limits[1])) for j, (low, high) in zip(nominal.joints, about, strict=True)
    ]
    return replace(
        nominal, joints=tuple(replace(j, limits=pair) for j, pair in zip(nominal.joints, limits, strict=True))
    )


def simulated(
    rng: np.random.Generator, width: float | None, targets: int, scale: float, joint_error: float, poses: int
) -> tuple[Twin, Dataset]:
    """Draw a truth of `scale` times the priors, and measure it with some of the three targets."""
    drawn = [p for p in nominal.parameters.values() if p.group in ("geometry", "joint zero")]
    twin = truth_twin(nominal.with_parameters(replace(p, prior=scale * p.prior) for p in drawn), "random", rng)
    tool = {t.name: [twin.robot.values[t.parameter(a)] for a in "xyz"] for t in twin.robot.targets[:targets]}
    twin = replace(twin, robot=twin.robot.with_frames(twin.robot.base, tool))
    commanded = narrowed(width).random_configurations(poses, rng)
    data = measure(twin, commanded + joint_error * rng.standard_normal(commanded.shape), NOISE, rng)
    return twin, replace(data, joints=commanded)


def judged(
    rng: np.random.Generator,
    width: float | None,
    targets: int,
    scale: float,
    repeatability: float = 0.0,
    poses: int = POSES,
) -> list[float]:
    """Calibrate one robot, whose joints repeat to so many degrees, as `truearm calibrate --model geometric` does.

    Returns true, expected, lowest, highest and held-out error [mm], 1 for a warning of narrow data and 2 for an error,
    and 1 if the fit converged.
    """
    joint_error = float(np.radians(repeatability))
    twin, data = simulated(rng, width, targets, scale, joint_error, poses)
    order = np.random.default_rng(0).permutation(poses)
    training, held_out = (data.of_configurations(part) for part in np.split(order, [round(0.7 * poses)]))
    fit = identify(nominal, training, GEOMETRIC)
    after = errors_of(fit.robot, held_out)
    expected = expected_error(as_residuals_allow(fit, training))
    notices = check_narrow_data(fit, expected, training, after, held_out=True)
    # The truth has no effects that the twin alone would know.
    q = nominal.random_configurations(JUDGED, rng)
    there = q + joint_error * rng.standard_normal(q.shape)
    apart = [fit.robot.world_poses(q, t.name)[0] - twin.robot.world_poses(there, t.name)[0] for t in fit.robot.targets]
    true = float(np.linalg.norm(apart, axis=2).mean())
    of, known = expected.overall, after.position_norms.mean()
    noticed = max(({"warning": 1.0, "error": 2.0}[notice.level] for notice in notices), default=0.0)
    converged = float(fit.status is Status.CONVERGED)
    return [*(1e3 * length for length in (true, of.mean, *of.interval_90, known)), noticed, converged]


def in_a_loop(rng: np.random.Generator, device: str, scale: float, poses: int) -> list[float]:
    """Calibrate one robot by a device on all its readings; return true, expected, lowest and highest error [mm]."""
    drawn = [p for p in nominal.parameters.values() if p.group in ("geometry", "joint zero")]
    twin = truth_twin(nominal.with_parameters(replace(p, prior=scale * p.prior) for p in drawn), "random", rng)
    instrument = named_device(device)
    twin = replace(twin, robot=in_view_of(instrument, twin.robot))
    data = measured_with(instrument, nominal, twin, poses, rng)
    fit = identify(nominal, data, GEOMETRIC)
    of = expected_error(as_residuals_allow(fit, data)).overall
    q = nominal.random_configurations(JUDGED, rng)
    frames = seen_by(instrument, nominal, twin)[0].frames(q)
    found = np.concatenate([fit.robot.world_poses(q, t.name)[0] for t in fit.robot.targets])
    there = np.concatenate([frames[t.name][:, :3, 3] for t in fit.robot.targets])
    if fit.gauge_freedoms:
        R, t = rigid_motion(found, there)
        found = found @ R.T + t
    true = float(np.linalg.norm(found - there, axis=1).mean())
    return [1e3 * length for length in (true, of.mean, *of.interval_90)]


def loops(robots: int) -> Iterator[dict[str, Any]]:
    """Go through devices and scales, with new robots for each."""
    for k, (scale, (device, poses)) in enumerate((s, loop) for s in SCALES[:2] for loop in LOOPS):
        rows = []
        for seed in range(3 * robots):
            with suppress(InputError):  # few of the robots are not jogged to all places
                rows.append(in_a_loop(np.random.default_rng((200 + k, seed)), device, scale, poses))
        true, mean, low, high = np.array(rows).T
        yield {
            "device": device,
            "poses": poses,
            "scale": scale,
            "robots": len(rows),
            "inside": float(np.mean((low <= true) & (true <= high))),
            "below_the_end": float(np.mean(true <= high)),
            "ratio_median": float(np.median(true / mean)),
            "ratio_most": float(np.max(true / mean)),
            "true_mm": float(np.median(true)),
            "expected_mm": float(np.median(mean)),
        }


def cases(robots: int) -> Iterator[tuple[dict[str, Any], np.ndarray]]:
    """Go through scales, targets and widths, with new robots for each."""
    for k, (scale, targets, width) in enumerate((s, t, w) for s in SCALES for t in (1, 3) for w in WIDTHS):
        rows = [
            judged(np.random.default_rng((k, seed)), width, targets, scale)
            for seed in range(robots if scale != 1.0 else 3 * robots)
        ]
        yield {"scale": scale, "targets": targets, "width_deg": width, "robots": len(rows)}, np.array(rows)
    for k, (repeatability, targets, poses) in enumerate(
        (r, t, p) for r in REPEATABILITIES for t in (1, 3) for p in (FEW, POSES)
    ):
        rows = [
            judged(np.random.default_rng((50 + k, seed)), None, targets, 1.0, repeatability, poses)
            for seed in range(3 * robots)
        ]
        case = {"repeatability_deg": repeatability, "targets": targets, "poses": poses, "robots": len(rows)}
        yield case, np.array(rows)


def figures(rows: np.ndarray) -> dict[str, float]:
    """Summarise robots: how often the interval holds, true over expected error, and the notice."""
    true, mean, low, high, held, noticed, converged = rows.T
    lies = true > 3.0 * held
    return {
        "inside": float(np.mean((low <= true) & (true <= high))),
        "ratio_median": float(np.median(true / mean)),
        "ratio_least": float(np.min(true / mean)),
        "ratio_most": float(np.max(true / mean)),
        "true_mm": float(np.median(true)),
        "expected_mm": float(np.median(mean)),
        "held_out_mm": float(np.median(held)),
        "true_above_3_held_out": int(lies.sum()),
        "of_these_noticed": int((noticed[lies] > 0).sum()),
        "noticed": int((noticed > 0).sum()),
        "errors": int((noticed == 2).sum()),
        "converged": int(converged.sum()),
    }


def main() -> None:
    robots, campaigns = (int(sys.argv[i]) if len(sys.argv) > i else n for i, n in ((1, 40), (2, 100)))
    record: dict[str, Any] = {"cases": []}
    for case, rows in cases(robots):
        record["cases"].append({**case, **figures(rows)})
        print(json.dumps(record["cases"][-1]), flush=True)  # noqa: T201
    record["closed_loops"] = []
    for loop in loops(robots):
        record["closed_loops"].append(loop)
        print(json.dumps(loop), flush=True)  # noqa: T201
    full = [judged(np.random.default_rng((99, seed)), None, 3 if seed % 2 else 1, 1.0) for seed in range(campaigns)]
    record["full_range"] = {"campaigns": campaigns, **figures(np.array(full))}
    print(json.dumps(record["full_range"]))  # noqa: T201
    (Path(__file__).parent / "expected_error.json").write_text(json.dumps(record, indent=1) + "\n")


if __name__ == "__main__":
    main()
