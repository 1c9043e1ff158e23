"""Configurations that were recorded, read back and played."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from truearm.engine.base.errors import InputError
from truearm.engine.robot.library import load_robot
from truearm.planning.plan import plan
from truearm.simulation.jobs import simulate
from truearm.studio.recorded import Motion, Recorded, labels_text, list_of, read_recorded

Q = np.deg2rad([[10.0, 20.0, -15.0, 30.0, 40.0, -50.0], [0.0, 5.0, 5.0, 0.0, 30.0, 0.0]])


@pytest.mark.parametrize("name", ["irb120", "lrmate200ic"])
@pytest.mark.parametrize("whose", ["model", "controller"])
def test_what_is_recorded_is_read_again(tmp_path: Path, name: str, whose: str) -> None:
    robot = load_robot(name)
    made = Recorded((), np.zeros((0, 6)), whose)  # type: ignore[arg-type]
    for joints in Q:
        made = made.with_one(joints)
    (tmp_path / "recorded.csv").write_text(made.text(robot))
    heading = (tmp_path / "recorded.csv").read_text().splitlines()[0]
    assert heading.startswith("configuration,joint_1 [deg]" if whose == "model" else "configuration,axis_1 [deg]")
    read = read_recorded(tmp_path / "recorded.csv", robot)
    assert read.labels == ("P1", "P2")
    assert read.joints_are == whose
    assert read.joints == pytest.approx(Q, abs=1e-12)
    assert read.text(robot) == made.text(robot)
    assert read.without_last().labels == ("P1",)


def test_the_list_of_a_robot_has_a_name_that_files_can_have() -> None:
    assert list_of(replace(load_robot("irb120"), name="../my arm/ä")) == "recorded-..-my-arm-.csv"


def test_a_removed_name_is_not_given_twice() -> None:
    known = Recorded(("P1", "P7", "home"), np.concatenate([Q, Q[:1]]), "model")
    assert known.with_one(Q[0]).labels[-1] == "P8"


def test_plans_and_measurements_are_lists_of_configurations(tmp_path: Path) -> None:
    robot = load_robot("irb120")
    simulate(robot, truth="nominal", poses=5, noise=5e-5, seed=1, out=tmp_path / "data.csv")
    read = read_recorded(tmp_path / "data.csv", robot)
    assert len(read.labels) == 5
    planned = plan(robot, noise=5e-5, poses=30, candidates=60, seed=1, out=tmp_path / "plan.csv")
    assert read_recorded(tmp_path / "plan.csv", robot).joints == pytest.approx(planned.joints, abs=1e-9)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("configuration,x [mm]\na,1\n", "joint_1 is missing"),
        ("configuration,joint_1 [deg]\na,1\n", "another arm"),
        ("configuration,joint_1 [deg],joint_1 [deg]\na,1,2\n", "appears twice"),
        ("configuration;joint_1 [deg]\na;1\n", "not separated by commas"),
        ("configuration," + ",".join(f"joint_{k} [mm]" for k in range(1, 7)) + "\na,1,2,3,4,5,6\n", "joint_1"),
        ("configuration," + ",".join(f"joint_{k}" for k in range(1, 7)) + "\na,1,2,3,4,5,6\n", "unit"),
        ("configuration," + ",".join(f"joint_{k} [deg]" for k in range(1, 7)) + "\na,1,2,x,4,5,6\n", "line 2"),
        ("configuration," + ",".join(f"joint_{k} [deg]" for k in range(1, 7)) + "\n", "a header and no rows"),
        ("", "the file is empty"),
    ],
)
def test_other_tables_are_refused(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "list.csv").write_text(text)
    with pytest.raises(InputError, match=words):
        read_recorded(tmp_path / "list.csv", load_robot("irb120"))


def test_all_joints_arrive_together_and_the_fastest_keeps_the_speed() -> None:
    motion = Motion.through(Q, 10.0, load_robot("irb120"))
    assert motion.duration == pytest.approx(5.0)  # the sixth turns by 50 deg
    assert motion.at(2.5) == pytest.approx(Q.mean(axis=0))
    assert motion.at(-1.0) == pytest.approx(Q[0])
    assert motion.at(99.0) == pytest.approx(Q[1])
    assert Motion.through(Q[:1], 10.0, load_robot("irb120")).duration == 0.0


@pytest.mark.parametrize("speed", [0.0, -5.0, float("nan"), 1e6])
def test_a_speed_that_is_none_is_refused(speed: float) -> None:
    with pytest.raises(InputError, match="this is no speed"):
        Motion.through(Q, speed, load_robot("irb120"))


def test_many_labels_are_told_in_a_few_words() -> None:
    assert labels_text(["P1", "P2"]) == "P1, P2"
    assert labels_text([f"P{k}" for k in range(20)]) == "20, the last P14, P15, P16, P17, P18, P19"
