"""Write the poses of a public URDF that an arm of the library is held against, by Pinocchio and nothing of truearm.

A developer who has the URDF (xacro files expanded) runs it once for an arm::

    python tests/library/outside_poses.py irb1200.urdf --robot irb1200_5_0.9 --repository ros-industrial/abb \
        --path abb_irb1200_support/urdf/irb1200_5_90_macro.xacro --revision 532b39395dc7 \
        --base base --tip tool0 > tests/library/outside/irb1200_5_0.9.yaml

Where the URDF counts joints or has frames otherwise than the library, the entries `joints`, `model_base`,
`model_flange` and `reason` are added by hand, see tests/library/outside.py.
"""

from __future__ import annotations

import argparse
import sys
import zlib
from pathlib import Path
from typing import Any

import numpy as np

CONFIGURATIONS = 8


def main() -> None:
    """Write the file to standard output."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("urdf", type=Path)
    for name in ("robot", "repository", "path", "revision"):
        parser.add_argument(f"--{name}", required=True)
    parser.add_argument("--base", default="base")
    parser.add_argument("--tip", default="tool0")
    parser.add_argument("--joints", nargs="+", help="of the arm, in order; all that move if left out")
    sys.stdout.write(text(parser.parse_args()))


def text(given: argparse.Namespace) -> str:
    """Return the text of the file: limits [deg], joint positions [deg], positions [mm] and quaternions w x y z."""
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
        "# Poses of a public URDF, computed once by tests/library/outside_poses.py with Pinocchio. No URDF is copied.",
        f"robot: {given.robot}",
        f"source: {{repository: {given.repository}, path: {given.path}, revision: {given.revision}}}",
        f"base: {given.base}",
        f"tip: {given.tip}",
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
