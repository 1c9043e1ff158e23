from __future__ import annotations

import json

import numpy as np
import pytest

from truearm.engine.document.planning_figures import joint_trajectories, pose_cube
from truearm.engine.motion.cube import PLANES, Cube
from truearm.engine.motion.joint_motion import joint_motion
from truearm.engine.motion.largest_cube import plan_poses
from truearm.engine.motion.paths import timed
from truearm.engine.robot.library import load_robot

ROBOT = load_robot("irb120")
CUBE = Cube((0.35, 0.0, 0.4), 0.3)


def test_the_cube_shows_its_planes_its_poses_and_paths() -> None:
    plan = plan_poses(ROBOT, CUBE, count=20)
    path = timed(CUBE.planes[0].circle(0.1), 0.1, 0.4, 0.001)
    shown = pose_cube(plan, {"circle <b>": path.position})
    clouds = [trace for trace in shown["data"] if trace.get("mode") == "markers"]
    assert [trace["name"] for trace in clouds] == [f"plane {name}, 5 poses" for name in PLANES]
    numbers = [number for trace in clouds for number in trace["customdata"]]
    assert sorted(numbers) == list(range(1, 21))
    places = np.concatenate([np.transpose([trace[axis] for axis in "xyz"]) for trace in clouds])
    assert places == pytest.approx(1e3 * plan.points[np.array(numbers) - 1], abs=0.006)
    assert sum(trace["type"] == "mesh3d" for trace in shown["data"]) == 4
    (circle,) = [trace for trace in shown["data"] if trace.get("name", "").startswith("circle")]
    assert circle["name"] == "circle &lt;b&gt;"
    assert 100 < len(circle["x"]) <= 800
    edges = shown["data"][0]
    assert len(edges["x"]) == 12 * 3
    json.dumps(shown, allow_nan=False)


def test_a_plane_without_poses_is_drawn_too() -> None:
    shown = pose_cube(plan_poses(ROBOT, CUBE, count=2))
    assert sum(trace["type"] == "mesh3d" for trace in shown["data"]) == 4
    assert sum(trace.get("mode") == "markers" for trace in shown["data"]) == 2


def test_joint_trajectories_show_degrees_over_time() -> None:
    motion = joint_motion(ROBOT, timed(CUBE.planes[0].circle(0.1), 0.2, 0.8, 0.02))
    shown = joint_trajectories(motion, ROBOT)
    assert len(shown["data"]) == 18
    for place, values in (("y", motion.joints), ("y2", motion.velocity), ("y3", motion.acceleration)):
        curves = [trace for trace in shown["data"] if trace["yaxis"] == place]
        drawn = np.transpose([curve["y"] for curve in curves])
        assert drawn == pytest.approx(np.degrees(values), rel=1e-5, abs=1e-6)
        assert curves[0]["x"] == pytest.approx(motion.time, rel=1e-5)
    titles = [shown["layout"][axis]["title"]["text"] for axis in ("yaxis", "yaxis2", "yaxis3")]
    assert titles == ["position [deg]", "velocity [deg/s]", "acceleration [deg/s²]"]
    json.dumps(shown, allow_nan=False)
