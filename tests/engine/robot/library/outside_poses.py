"""Write the poses of a public URDF that an arm of the library is held against, by Pinocchio and nothing of truearm.

Get the URDF at the revision that ``outside`` names. Xacro files have to be expanded (the package xacro of ROS
does it: ``xacro robot.xacro > robot.urdf``), or their links and the ``<origin>``, ``<axis>`` and ``<limit>`` of their
joints copied into a short URDF: meshes and inertias are not needed. Then::

    python outside_poses.py irb1200.urdf --robot irb1200_5_0.9 --repository ros-industrial/abb \
        --path abb_irb1200_support/urdf/irb1200_5_90_macro.xacro --revision 532b39395dc7 --base base --tip tool0

That prints the file; ``> outside/irb1200_5_0.9.yaml`` keeps it. The same URDF gives the same joint
positions and poses again. Where a URDF counts joints or has frames otherwise than the library, the entries `joints`,
`model_base`, `model_flange`, `reason` and `limits_differ` are written by hand, see outside.py. Those of a
file that is there already are kept. ``--check`` prints nothing, and fails if the file that is there has other poses.
"""

from __future__ import annotations

import argparse
import re
import sys
import zlib
from pathlib import Path
from typing import Any

import numpy as np

CONFIGURATIONS = 8
#: Entries that are written by hand.
BY_HAND = ("joints", "model_base", "model_flange", "reason", "limits_differ")
#: Positions [mm] and quaternions that differ by less are the same.
SAME = 2e-6


def main() -> None:
    """Write the file to standard output."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("urdf", type=Path)
    for name in ("robot", "repository", "path", "revision"):
        parser.add_argument(f"--{name}", required=True)
    parser.add_argument("--base", default="base")
    parser.add_argument("--tip", default="tool0")
    parser.add_argument("--joints", nargs="+", help="of the arm, in order; all that move if left out")
    parser.add_argument("--check", action="store_true", help="compare with the file that is there")
    given = parser.parse_args()
    stored = Path(__file__).with_name("outside") / f"{given.robot}.yaml"
    content = text(given, stored.read_text("utf-8") if stored.is_file() else "")
    if not given.check:
        sys.stdout.write(content)
    elif not same_poses(content, stored.read_text("utf-8")):
        sys.exit(f"{stored} has other poses than {given.urdf}")


def same_poses(first: str, other: str) -> bool:
    """Return whether two files have the same joint positions and poses."""
    numbers = [
        [float(v) for v in re.findall(r"-?[0-9.]+(?:e-?[0-9]+)?", text.split("poses:")[1])] for text in (first, other)
    ]
    return len(numbers[0]) == len(numbers[1]) and max(abs(a - b) for a, b in zip(*numbers, strict=True)) <= SAME


def text(given: argparse.Namespace, stored: str = "") -> str:
    """Return the text of the file: limits [deg], joint positions [deg], positions [mm] and quaternions w x y z.

    Parameters
    ----------
    stored
        Text of the file that is there, whose entries by hand are kept.
    """
    import pinocchio

    model: Any = pinocchio.buildModelFromUrdf(str(given.urdf))
    names = given.joints or list(model.names[1:])
    for name in (given.base, given.tip):
        assert model.existFrame(name), f"there is no link {name}"
    ids = [model.getJointId(name) for name in names]
    places = [model.joints[i].idx_q for i in ids]
    assert all(model.joints[i].nq == 1 for i in ids), "continuous joints: make them revolute, with the maker's limits"
    low, high = (np.degrees(v[places]) for v in (model.lowerPositionLimit, model.upperPositionLimit))
    limits = [[round(float(a), 2), round(float(b), 2)] for a, b in zip(low, high, strict=True)]
    rng = np.random.default_rng(zlib.crc32(given.robot.encode()))
    drawn = rng.uniform(low, high, (CONFIGURATIONS - 1, len(names))).round(1)
    lines = [
        "# Poses of a public URDF, computed once by outside_poses.py with Pinocchio. No URDF is copied.",
        f"robot: {given.robot}",
        f"source: {{repository: {given.repository}, path: {given.path}, revision: {given.revision}}}",
        f"base: {given.base}",
        f"tip: {given.tip}",
        *(line for line in stored.splitlines() if line.partition(":")[0] in BY_HAND),
        f"limits: {limits}",
        "poses:",
    ]
    data = model.createData()
    base, tip = (model.getFrameId(name) for name in (given.base, given.tip))
    for row in np.vstack([np.zeros(len(names)), drawn]):
        q = pinocchio.neutral(model)
        q[places] = np.radians(row)
        pinocchio.framesForwardKinematics(model, data, q)
        pose = data.oMf[base].inverse() * data.oMf[tip]
        turn = pinocchio.Quaternion(pose.rotation).normalized()
        quaternion = [round(float(v), 12) + 0.0 for v in (turn.w, turn.x, turn.y, turn.z)]
        at = [round(float(v) * 1e3, 6) + 0.0 for v in pose.translation]
        lines.append(f"  - {{joints: {row.tolist()}, position: {at}, quaternion: {quaternion}}}")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
