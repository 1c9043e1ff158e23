"""The controller of a Universal Robots arm, written by hand for tests: it knows nothing of truearm's chain.

It computes with a Denavit-Hartenberg table to which the factory added differences, as they were published of real arms.
The arm itself is a product of exponentials about the axes of that table, a little aside of where the factory saw them.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: theta, a, d, alpha that are added to the table. forum.universal-robots.com, thread 18921: by its lengths a UR10.
UR10_CONF = """\
[mounting]
delta_theta = [ -8.20642406610186392e-05, -0.103609197138685979, 0.673631891251821102, -0.57016974724960845, \
-4.59636351675856217e-05, 9.74999561134540574e-07]
delta_a = [ -0.000161187342296687116, 0.00304003843792177708, 0.0916468555721788314, -9.62964975953143595e-05, \
-2.97595340762196176e-05, 0]
delta_d = [ 0.000505390894843998906, 11.1984514757821039, -92.5270326908668181, 81.3282683520703529, \
-0.000212852818740727479, -0.000126145560998547346]
delta_alpha = [ -0.00032142399895862539, -0.00565024518540147101, -0.00378922621833689211, -0.00106533274011644252, \
0.000999586303470856308, 0]
joint_checksum = [ 0x6e0f7bf, 0xa32a713f, 0xf636a50, 0x9ec2338a, 0xa1afded8, 0xb29b2979]
calibration_status = 2 # 0 == notInitialized / 1 == notLinearised / 2 == Linearised
"""
#: MyRobotLab/pyrobotlab, issue 145: an arm with the lengths of a UR3e.
UR3E_CONF = """\
[mounting]
delta_theta = [ 9.14361764983717684e-08, 0.178461025123001604, 6.68283349819805572, -0.578116982609792496, \
6.11299818305960363e-06, -5.03926212855332345e-07]
delta_a = [ -0.000243788991999517813, 0.00381165418642351317, 0.034503078453104935, 0.000107694612896758047, \
-0.000198736633205663144, 0]
delta_d = [ 9.225352853908797e-05, 12.0620003757611567, 17.6719025641737275, -29.7339960369544869, \
-2.8164617795367608e-05, 0.000217420471082099831]
delta_alpha = [ 0.00115615746589403656, 0.0035851898103369975, 0.00392132336586574568, 0.000406668888106365145, \
-0.00201170396009153762, 0]
joint_checksum = [ 0xb3241580, 0xb10112f1, 0x290cac88, 0xa8d3f155, 0xa8b7e9eb, 0xa8dbbfa3]
calibration_status = 2
"""
#: theta, a, d, alpha of a UR10e as its controller has them: Universal_Robots_ROS2_Driver, ur_calibration,
#: doc/algorithm.rst.
UR10E_TABLE = (
    (-2.4147806894359e-07, 1.60233952386695, -1.68607190752171, 0.0837331147700119, -1.01260355871158e-07, 3.9e-08),
    (2.12234865571206e-05, 0.0193171326277006, -0.569251663611088, -4.6140902372093e-05, -6.39280053471802e-05, 0.0),
    (0.180539811714259, 439.140974079901, -446.027059806332, 7.0603368964236, 0.119811341150314, 0.115670917257426),
    (1.57014608044242, 0.0013941666682559, 0.00693818880325995, 1.56998468543761, -1.57038520649543, 0.0),
)
#: a and d of the types [m]: Universal Robots, "DH parameters for calculations of kinematics and dynamics".
TYPES = {
    "ur3e": ((0, -0.24355, -0.2132, 0, 0, 0), (0.15185, 0, 0, 0.13105, 0.08535, 0.0921)),
    "ur5e": ((0, -0.425, -0.3922, 0, 0, 0), (0.1625, 0, 0, 0.1333, 0.0997, 0.0996)),
    "ur10": ((0, -0.612, -0.5723, 0, 0, 0), (0.1273, 0, 0, 0.163941, 0.1157, 0.0922)),
    "ur10e": ((0, -0.6127, -0.57155, 0, 0, 0), (0.1807, 0, 0, 0.17415, 0.11985, 0.11655)),
}
ALPHA = np.array([1, 0, 0, 1, -1, 0]) * np.pi / 2


def deltas(conf: str) -> tuple[Array, Array, Array, Array]:
    """Return theta, a, d and alpha of a calibration.conf."""
    found = dict(re.findall(r"delta_(\w+) = \[([^\]]*)\]", conf))
    theta, a, d, alpha = (np.array(found[n].split(","), float) for n in ("theta", "a", "d", "alpha"))
    return theta, a, d, alpha


def conf_of(theta: Array, a: Array, d: Array, alpha: Array) -> str:
    """Return the text of a calibration.conf."""
    lists = {"theta": theta, "a": a, "d": d, "alpha": alpha}
    lines = [f"delta_{name} = [ {', '.join(f'{v:.18g}' for v in values)}]" for name, values in lists.items()]
    return "\n".join(["[mounting]", *lines, "calibration_status = 2", ""])


def table(robot: str, conf: str | None = None) -> tuple[Array, Array, Array, Array]:
    """Return theta, a, d and alpha of a type, with the differences of a file."""
    a, d = (np.array(values, float) for values in TYPES[robot])
    if conf is None:
        return np.zeros(6), a, d, ALPHA
    more = deltas(conf)
    return more[0], a + more[1], d + more[2], ALPHA + more[3]


def links(rows: tuple[Array, Array, Array, Array], joints: Array) -> list[Array]:
    """Return the poses of all six frames of a table, ``(n, 4, 4)`` each."""
    pose, found = np.tile(np.eye(4), (len(joints), 1, 1)), []
    for theta, a, d, alpha, q in zip(*rows, joints.T, strict=True):
        c, s, ca, sa = np.cos(q + theta), np.sin(q + theta), np.cos(alpha), np.sin(alpha)
        link = np.zeros((len(joints), 4, 4))
        link[:, 0] = np.stack([c, -s * ca, s * sa, a * c], axis=1)
        link[:, 1] = np.stack([s, c * ca, -c * sa, a * s], axis=1)
        link[:, 2, 1:] = sa, ca, d
        link[:, 3, 3] = 1.0
        pose = pose @ link
        found.append(pose)
    return found


def forward(rows: tuple[Array, Array, Array, Array], joints: Array) -> Array:
    """Return poses ``(n, 4, 4)`` of the flange."""
    return links(rows, joints)[-1]


def rotation(vector: Array) -> Array:
    """Return the matrix of a rotation vector (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector / angle if angle else vector
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K)


def vector(R: Array) -> Array:
    """Return the rotation vector of a matrix that turns by less than half a turn."""
    sine = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    size = float(np.linalg.norm(sine))
    return np.asarray(sine * (np.arctan2(size, (np.trace(R) - 1) / 2) / size if size else 1.0))


def inverse(rows: tuple[Array, Array, Array, Array], pose: Array, near: Array) -> Array:
    """Return the joints near others that bring the flange to a pose, by Newton steps with differences."""
    q = near.copy()
    for _ in range(30):
        steps = np.concatenate([np.zeros((1, 6)), np.eye(6) * 1e-6])
        poses = forward(rows, q + steps)
        here, moved = poses[0], poses[1:]
        missed = np.concatenate([pose[:3, 3] - here[:3, 3], vector(pose[:3, :3] @ here[:3, :3].T)])
        rates = [np.concatenate([m[:3, 3] - here[:3, 3], vector(m[:3, :3] @ here[:3, :3].T)]) / 1e-6 for m in moved]
        step = np.linalg.lstsq(np.array(rates).T, missed, rcond=None)[0]
        q = q + step * min(1.0, 0.3 / float(np.abs(step).max()))
        if np.abs(missed).max() < 1e-11:
            found: Array = q
            return found
    raise AssertionError("the controller does not reach this pose")


@dataclass(frozen=True)
class Arm:
    """What stands in the cell: six axes as lines at zero joint positions, and the flange."""

    along: Array
    point: Array
    flange: Array

    @classmethod
    def like(cls, robot: str, conf: str, rng: np.random.Generator, size: float) -> Arm:
        """Return an arm whose axes lie a little aside of where the factory saw them [m; rad in proportion]."""
        frames = [np.eye(4), *(frame[0] for frame in links(table(robot, conf), np.zeros((1, 6))))]
        nominal = [np.eye(4), *(frame[0] for frame in links(table(robot), np.zeros((1, 6))))]
        along, point = [], []
        for measured, plain in zip(frames[:-1], nominal[:-1], strict=True):
            z = measured[:3, 2]
            here = measured[:3, 3] + ((plain[:3, 3] - measured[:3, 3]) @ z) * z
            along.append(rotation(rng.normal(0, size, 3)) @ z)
            point.append(here + rng.normal(0, size, 3))
        return cls(np.array(along), np.array(point), frames[-1])

    def poses(self, joints: Array) -> Array:
        """Return poses ``(n, 4, 4)`` of the flange."""
        found = []
        for q in joints:
            pose = np.eye(4)
            for w, p, angle in zip(self.along, self.point, q, strict=True):
                turn = np.eye(4)
                turn[:3, :3] = rotation(w * angle)
                turn[:3, 3] = p - turn[:3, :3] @ p
                pose = pose @ turn
            found.append(pose @ self.flange)
        return np.array(found)
