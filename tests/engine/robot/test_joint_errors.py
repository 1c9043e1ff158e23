"""The convention of joint errors against the KR5 paper's matrices."""

from __future__ import annotations

import math

import numpy as np
from numpy.testing import assert_allclose
from tests.engine.robot.test_conventions import about, slid

from truearm.engine.robot.chain import Array
from truearm.engine.robot.conversion import converted
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot

#: Table 3: ebeta, egamma [deg], ex, ey, ez [mm].
TABLE_3 = (
    (-0.0331, 0.0218, -0.3702, -0.7174, -0.0005),
    (0.1813, 0.0068, -0.4168, 0.3069, 0.0014),
    (-0.0069, 0.0034, 0.9521, 0.5143, 0.0001),
    (-0.0295, 0.0031, 0.3414, -0.2313, 0.0002),
    (-0.0198, 0.0361, 0.4848, 0.3526, 0.0004),
    (-0.0129, 0.0772, -0.4767, -0.4767, 0.0007),
)
#: Table 1: turn of each link and its translation [mm].
TABLE_1 = (
    (("x", 180), (0, 0, 225)),
    (("x", 90), (180, 120, -175)),
    (("z", -90), (600, 0, -15)),
    (("x", 90), (120, 413.5, 135)),
    (("x", -90), (0, 0, -206.5)),
    (("x", 90), (0, 108.8, 0)),
    (("y", 180), (0, 0, -6.2)),
)


def with_table_3() -> Robot:
    values: dict[str, float] = {}
    for number, (ebeta, egamma, *slides) in enumerate(TABLE_3, 1):
        values |= {f"ebeta_{number}": math.radians(ebeta), f"egamma_{number}": math.radians(egamma)}
        values |= {f"{name}_{number}": v / 1e3 for name, v in zip(("ex", "ey", "ez"), slides, strict=True)}
    return converted(load_robot("kr5"), "joint-errors").with_values(values)


def error(ebeta: float, egamma: float, ex: float, ey: float, ez: float) -> Array:
    """Equation 6, with egamma about x first."""
    cb, sb, cg, sg = (f(math.radians(a)) for a in (ebeta, egamma) for f in (math.cos, math.sin))
    return np.array(
        [[cb, 0, sb, ex / 1e3], [sb * sg, cg, -cb * sg, ey / 1e3], [-sb * cg, sg, cb * cg, ez / 1e3], [0, 0, 0, 1]]
    )


def test_it_is_equation_7() -> None:
    for seed in range(3):
        q = np.random.default_rng(seed).uniform(-3, 3, 6)
        T = np.eye(4)
        for i, ((axis, angle), translation) in enumerate(TABLE_1):
            if i:
                T = T @ error(*TABLE_3[i - 1]) @ about("z", q[i - 1])
            T = T @ slid(*(np.array(translation) / 1e3)) @ about(axis, math.radians(angle))
        position, rotation = with_table_3().world_poses(q[None])
        assert_allclose(position[0], T[:3, 3], rtol=0, atol=1e-14)
        assert_allclose(rotation[0], T[:3, :3], rtol=0, atol=1e-14)


def test_the_library_truth_is_the_same_robot() -> None:
    """Its values were multiplied into the rows of Table 1."""
    plain = load_robot("kr5")
    truth = plain.with_values(plain.truths["axis-tests"].values)
    q = plain.random_configurations(20, np.random.default_rng(0))
    for actual, expected in zip(with_table_3().world_poses(q), truth.world_poses(q), strict=True):
        assert_allclose(actual, expected, rtol=0, atol=1e-12)


def test_thirty_errors_have_rank_25_and_23() -> None:
    robot = with_table_3()
    names = [n for n, p in robot.parameters.items() if p.group == "geometry"]
    assert len(names) == 30
    q = robot.random_configurations(30, np.random.default_rng(1))
    linear, angular = (part.reshape(30, -1).T for part in robot.jacobians(robot.forward_kinematics(q), q, names))
    assert np.linalg.matrix_rank(np.concatenate([linear, angular]), tol=1e-9) == 25
    assert np.linalg.matrix_rank(linear, tol=1e-9) == 23


def test_only_errors_and_zeros_are_parameters() -> None:
    robot = converted(load_robot("ur5"), "joint-errors")
    names = {n.rpartition("_")[0] for n, p in robot.parameters.items() if p.group in ("geometry", "joint zero")}
    assert names == {"ex", "ey", "ez", "egamma", "ebeta", "theta_offset"}
    assert all(p.nominal == 0.0 for p in robot.parameters.values())
