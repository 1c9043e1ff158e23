"""Writes the arrays that all contenders read. Arguments: the folder, and that of the measured data if there is one."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from truearm.engine.robot.inverse.branches import BRANCHES, branch_rule
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.urdf_writing import urdf_text
from truearm.engine.twin.truths import truth_twin
from truearm.importing.files import read_matrices

CONFIGURATIONS, POSES = 1000, 10_000
TRAIN, HELD_OUT, CAMPAIGNS, NOISE = 50, 200, 5, 0.05e-3

folder = Path(sys.argv[1])
rng = np.random.default_rng(120)
nominal = load_robot("irb120")
real = nominal.with_values(
    {
        p.name: p.value + p.prior * rng.standard_normal()
        for p in nominal.parameters.values()
        if p.group in ("geometry", "joint zero")
    }
)
# Kinematics: a robot with real values, and the nominal one, whose parallel axes need no beta.
for name, robot in (("real", real), ("nominal", nominal)):
    (folder / f"{name}.urdf").write_text(urdf_text(robot)[0])
dh = [[robot.row.get(c, 0.0) for c in ("alpha", "a", "theta_offset", "d")] for robot in nominal.joints]
q = nominal.random_configurations(CONFIGURATIONS, rng)
np.savez(
    folder / "kinematics.npz",
    q=q,
    names=list(real.parameters),
    values=list(real.values.values()),
    modified_dh=dh,
    position=real.world_poses(q)[0],
    jacobian=real.joint_jacobian(q),
    nominal_position=nominal.world_poses(q)[0],
)
# Inverse kinematics: poses that the robot reaches on one branch, and seeds up to 0.1 rad away.
rule = branch_rule(nominal)
assert rule is not None
q = nominal.random_configurations(16 * POSES, rng)
q = q[rule.numbers(real.forward_kinematics(q)) == BRANCHES.index("front-up-noflip")][:POSES]
assert len(q) == POSES
position, rotation = real.world_poses(q)
np.savez(folder / "inverse.npz", position=position, rotation=rotation, seed=q + rng.uniform(-0.1, 0.1, q.shape))
# Fits: what a tracker reads of three targets, and where the targets truly are at configurations held out.
for campaign in range(CAMPAIGNS):
    twin = truth_twin(nominal, "random", rng).robot
    train, held_out = (nominal.random_configurations(n, rng) for n in (TRAIN, HELD_OUT))
    seen, true = (np.stack([twin.world_poses(part, t.name)[0] for t in twin.targets], 1) for part in (train, held_out))
    seen = seen + NOISE * rng.standard_normal(seen.shape)
    np.savez(folder / f"simulated-{campaign}.npz", q=train, position=seen, held_out=held_out, held_out_position=true)
if len(sys.argv) > 2:
    source = Path(sys.argv[2]) / "irb120-faro"
    targets = {str(i): source / f"target_{i}.txt" for i in (1, 2, 3)}
    data, _ = read_matrices(source / "joints_commanded.txt", targets, {}, "deg", "mm")
    position = np.empty((data.configurations, len(data.targets), 3))
    position[data.configuration, data.target] = data.position
    whole = np.flatnonzero(np.isfinite(position).all(axis=(1, 2)))
    for campaign in range(CAMPAIGNS):
        order = rng.permutation(whole)
        train, held_out = order[:TRAIN], order[TRAIN:]
        np.savez(
            folder / f"measured-{campaign}.npz",
            q=data.joints[train],
            position=position[train],
            held_out=data.joints[held_out],
            held_out_position=position[held_out],
        )
