"""Plans with the program that drives them: what is written, what is refused, and what is said."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.plan_tours import a_tour
from tests.simulated import campaign

import truearm
from truearm.engine.base.errors import InputError, Notice
from truearm.engine.base.manifest import MANIFEST, hash_of
from truearm.engine.document.document import json_of
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.devices import named_device
from truearm.planning.choosing import device_candidates
from truearm.planning.plan import PlanPoses
from truearm.planning.programs import program_wanted, refuse_other_programs, with_program
from truearm.planning.result import Plan

#: Enough for a plan, and quick.
QUICK: dict[str, Any] = {"poses": 10, "candidates": 60, "clearance": 0.02, "seed": 1}
FILES = ["MEASURE.mod", "plan-ways.csv", "plan.csv", "plan.html", "sheet.html"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("driven") / "out"


@pytest.fixture(scope="module")
def planned(folder: Path) -> Plan:
    return truearm.plan(
        "irb120", **QUICK, program="rapid", approach=True, wait="operator", payload="1.5kg,0mm,0mm,60mm", out=folder
    )


def wanted(**options: Any) -> Any:
    asked = PlanPoses("irb120", poses=8, **{"program": "rapid", **options})
    return program_wanted(asked.program, approach=asked.approach, speed=asked.speed, dwell=asked.dwell, wait=asked.wait)


def test_a_folder_has_the_plan_its_ways_the_sheet_and_the_program(planned: Plan, folder: Path) -> None:
    assert planned.program is not None
    assert planned.tour is not None
    assert sorted(path.name for path in folder.iterdir()) == sorted([*FILES, MANIFEST])
    text = (folder / "MEASURE.mod").read_text()
    assert text.count("! Measure ") == text.count("! Approach") == 10
    assert text.count("MoveAbsJ") == len(planned.tour.stops)
    assert [stop.label for stop in planned.tour.measured] == list(planned.labels)
    again = planned.save(folder.parent / "again")
    assert sorted(path.name for path in again) == FILES
    assert (folder.parent / "again" / "MEASURE.mod").read_text() == text
    assert sorted(path.name for path in planned.save(folder)) == FILES
    mark = hash_of((folder / "plan.csv").read_bytes())[:12]
    assert f"\n  ! Plan {mark}\n" in text


def test_a_plan_tells_of_its_program(planned: Plan) -> None:
    lines = "\n".join(planned.lines())
    assert "Measuring program in RAPID: 10 configurations from Home and back, each approached from one side." in lines
    assert "In the data the column order counts these stops, too: 2, 4, 6 and so on." in lines
    speeds = "250, 250, 250, 320, 320, 420 deg/s"
    assert f"At most 250 mm/s and 10 % of the joints' speed ({speeds}); it stands for 2 s, then until" in lines
    assert "It tells the controller of target 2 at (75, 93.7, 215) mm and of 1.5 kg at (0, 0, 60) mm." in lines
    assert "It is not verified and no safety function" in lines
    summary = planned.summary()["program"]
    expected = {"language": "RAPID", "files": ["MEASURE.mod"], "order": list(planned.labels), "approached": True}
    expected |= {"speed_mm_s": 250.0, "joint_speed_percent": 10.0, "dwell_s": 2.0, "joint_speeds": speeds}
    assert summary == summary | expected | {"wait": "operator", "tip": "2", "load_kg": 1.5}
    assert [notice["code"] for notice in summary["warnings"]] == ["tool-assumed"]
    assumed = summary["warnings"][0]["message"]
    assert "Nobody said the targets of the flange" in assumed
    assert "target 2 at (75, 93.7, 215) mm, target 3 at (150, 0, 125) mm (the first tool of the robot" in assumed
    assert "kg" not in assumed


def test_the_sheet_has_every_configuration_and_room_to_write(planned: Plan, folder: Path) -> None:
    sheet = (folder / "sheet.html").read_text()
    rows = sheet.split("Configurations, in the order of the program")[1].split("</table>")[0]
    assert rows.count('<td class="label">') == 11
    assert rows.index("Home") < rows.index(f'<td class="label">{planned.labels[0]}</td>')
    assert planned.program is not None
    assert f"Plan {planned.program.mark}" in sheet
    assert planned.program.mark in (folder / "MEASURE.mod").read_text()
    for words in planned.driving:
        assert words in sheet
    for label in planned.labels:
        assert f'<td class="label">{label}</td>' in rows
    assert rows.count('<span class="box">') == 10 * 4 + 1  # three targets, and done
    first = planned.made.robot.controller.from_model(planned.joints[:1])[0, 0]
    assert f'<td class="joints">{round(first * 57.29577951, 2):.2f}</td>' in rows
    for words in ("Temp. [&deg;C]", "Start x [mm]", "End z [mm]", "operator", "Instrument: serial", "Environment:"):
        assert words in sheet
    assert "<script" not in sheet
    page = (folder / "plan.html").read_text()
    assert "`" not in page.split("<main>")[1].split("</main>")[0]
    assert "give <code>noise</code> where you know better" in page
    assert '<p class="notice warning" data-code="tool-assumed"><strong>Warning</strong> (tool-assumed): ' in page
    assert len(sheet) < 60_000


def test_a_plan_without_a_program_stays_a_file(tmp_path: Path) -> None:
    plain = truearm.plan("irb120", **QUICK, out=tmp_path / "plan.csv")
    assert plain.program is None
    assert "program" not in plain.summary()
    files = ["plan-sheet.html", "plan-ways.csv", "plan.csv", "plan.html", MANIFEST]
    assert sorted(path.name for path in tmp_path.iterdir()) == files


@pytest.mark.parametrize(
    ("options", "parameter", "message"),
    [
        ({"program": None, "approach": True}, "approach", "none is asked for"),
        ({"program": None, "speed": (0.1,)}, "speed", "none is asked for"),
        ({"program": None, "dwell": 2.0}, "dwell", "none is asked for"),
        ({"program": None, "wait": "time"}, "wait", "none is asked for"),
        ({"speed": ()}, "speed", "one or two numbers"),
        ({"speed": (0.1, 0.1, 0.1)}, "speed", "one or two numbers"),
        ({"speed": "250"}, "speed", "250"),
        ({"speed": (0.0,)}, "speed", "0 mm/s.*1 to 5000 mm/s"),
        ({"speed": (-0.25,)}, "speed", "-250 mm/s"),
        ({"speed": (250.0,)}, "speed", "250000 mm/s"),
        ({"speed": (float("nan"),)}, "speed", "nan"),
        ({"speed": (0.25, 0.0)}, "speed", "0 %.*1 to 100 %"),
        ({"speed": (0.25, 10.0)}, "speed", "1000 %"),
        ({"wait": "forever"}, "wait", "there is no such wait; got 'forever'; allowed: time; input N"),
        ({"wait": "input"}, "wait", "there is no such wait"),
        ({"wait": "input "}, "wait", "no digital input"),
        ({"wait": "input -3"}, "wait", "no digital input"),
        ({"wait": "input 3;Stop"}, "wait", "no digital input"),
        ({"wait": "input 3,300"}, "wait", "this is no time; got '300'; allowed: input 3,300s"),
        ({"wait": "input 3,s"}, "wait", "this is no time"),
        ({"wait": "input 3,0s"}, "wait", "waited for a while"),
        ({"wait": "input 3,301s"}, "wait", "up to 300 s"),
        ({"program": "krl", "wait": "input diReady"}, "wait", "digital inputs have numbers in KRL"),
        ({"program": "urscript", "wait": "input 8"}, "wait", "has no such digital input"),
        ({"program": "krl", "wait": "input 0"}, "wait", "has no such digital input"),
        ({"program": "krl", "wait": "input 99999"}, "wait", "has no such digital input"),
    ],
)
def test_what_cannot_be_driven_is_refused(options: dict[str, Any], parameter: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as refusal:
        wanted(**options)
    assert refusal.value.parameter == parameter


def test_what_is_asked_of_a_program_is_taken(planned: Plan) -> None:
    assert wanted(speed=(0.1,)).driving.share == 0.1
    assert wanted(speed=[0.5, 0.25]).driving.speed == 0.5
    assert wanted(wait="input diReady,12.5s").driving.words == "input diReady, 12.5 s"
    assert wanted(wait="input 3").driving.longest == 300.0
    named = with_program(planned, wanted(wait="input diReady"), planned.made.robot, weighed=True)
    assert named.program is not None
    assert "WaitDI diReady,1" in named.program.files["MEASURE.mod"]
    assert "then for input diReady up to 300 s" in "\n".join(named.lines())
    assert not named.program.warnings


def test_a_speed_below_the_lowest_share_of_a_language_is_told(planned: Plan) -> None:
    known = planned.made.robot
    unknown = replace(known, joints=tuple(replace(joint, max_speed=None) for joint in known.joints))
    for program, robot, codes in (
        ("krl", unknown, ["faster-than-asked", "joint-speed-assumed"]),
        ("krl", known, ["faster-than-asked"]),
        ("val3", unknown, ["joint-speed-assumed"]),
    ):
        changed = replace(planned, made=replace(planned.made, robot=robot))
        slow = with_program(changed, wanted(program=program, speed=(0.01,)), robot, weighed=True).program
        assert slow is not None
        assert [notice.code for notice in slow.warnings] == codes
        assert bool(slow.speeds) == (robot is known)
        assert ("as fast as any" in slow.warnings[0].message) == (program == "krl" and robot is unknown)
        assert (slow.fastest > 0.011) == (program == "krl")
        assert json_of(slow.blocks())["speed_mm_s"] == 1e3 * slow.fastest
    assert "KRL says no share below 1 %" not in "\n".join(planned.lines())


@pytest.mark.parametrize(
    ("robot", "program", "message"),
    [
        ("kr5", "rapid", "the controllers of KUKA do not speak RAPID; got 'rapid'; allowed: krl. Take `program=krl`"),
        ("irb120", "urscript", "the controllers of ABB do not speak URScript; .*allowed: rapid"),
        ("ur5e", "inform", "the controllers of Universal Robots do not speak INFORM; .*allowed: urscript"),
        ("lrmate200ic", "val3", "the controllers of FANUC do not speak VAL3; .*allowed: fanuc"),
        ("katana450", "fanuc", "the controllers of Neuronics do not speak .*allowed: none of the languages"),
        ("fr3", "krl", "the controllers of Franka Robotics do not speak KRL"),
        (replace(truearm.load_robot("fr3"), maker=""), "krl", "arms of up to six joints; got '7 joints'"),
    ],
)
def test_a_language_that_the_controller_does_not_speak_is_refused(
    robot: str | Robot, program: str, message: str
) -> None:
    with pytest.raises(InputError, match=message) as refusal:
        truearm.plan(robot, poses=20, program=program)
    assert refusal.value.parameter in ("program", "robot")


def test_of_a_robot_without_a_maker_every_language_is_taken(planned: Plan) -> None:
    robot, tour = a_tour(replace(truearm.load_robot("puma560"), maker=""))
    tour = replace(tour, notices=(Notice("never-apart", "What the ways say is said of the program, too.", "note"),))
    measured = replace(
        planned.made,
        robot=robot,
        joints=tour.joints[1:5],
        before=tour.joints[1:5],
        labels=("1", "2", "3", "4"),
        reads=(),
    )
    for program in ("rapid", "krl", "fanuc", "urscript", "inform", "val3"):
        asked = wanted(program=program)
        if program == "fanuc":
            with pytest.raises(InputError, match="controllers that run FANUC LS count joint 3 together with joint 2"):
                asked.check(robot)
            continue
        asked.check(robot)
        driven = with_program(
            replace(planned, made=measured, tour=tour, program=None), asked, robot, weighed=False
        ).program
        assert driven is not None
        notices = list(driven.warnings)
        if program == "krl":  # at 1 %, the first move of an arm as fast as any
            assert notices.pop(0).code == "faster-than-asked"
        codes = [notice.code for notice in notices]
        assert codes == ["controller-counts-assumed", "tool-assumed", "joint-speed-assumed", "never-apart"]
        assert [notice.level for notice in notices] == ["warning", "warning", "note", "note"]
        assert any("compare joints with the pendant" in text for text in driven.files.values())
        assert "Nobody said the load of the flange" in notices[1].message
        assert "what is assumed, 0 kg at (0, 0, 0) mm. A wrong load" in notices[1].message
        by_hand = {"fanuc": "Payload schedule 1 on", "inform": "Tool file 0 on", "val3": "The tool flange on"}
        assert by_hand.get(program, "It tells the controller of") in "\n".join(driven.answer)


def test_joints_of_a_short_arm_are_driven() -> None:
    robot: Robot = truearm.load_robot("li3")
    assert len(robot.joints) < 6
    planned = truearm.plan(
        robot, poses=12, candidates=80, no_floor=True, clearance=0.0, program="krl", payload=Payload()
    )
    assert planned.program is not None
    assert "PTP {A1 " in planned.program.files["MEASURE.src"]


def test_a_program_never_drives_the_arm_to_what_it_touches() -> None:
    for device in ("ballbar", "hexapod", "plane", "two-sockets", "touch-up"):
        with pytest.raises(InputError, match="brought to what it touches by hand, not by a program; got") as refusal:
            truearm.plan("irb120", poses=10, candidates=30, device=device, program="rapid")
        assert refusal.value.parameter == "program, device"
    _, touched, _ = device_candidates(truearm.load_robot("irb120"), named_device("plane"), 20, np.random.default_rng(0))
    with pytest.raises(
        InputError, match="the arm may touch what these readings are against, and is brought there"
    ) as refusal:
        wanted().check_readings(touched)
    assert refusal.value.parameter == "program, candidates_from"
    wanted().check_readings(campaign("irb120", 12, 0.05e-3, 1)[1])


def test_many_targets_are_ticked_together(planned: Plan, tmp_path: Path) -> None:
    robot = planned.made.robot
    crowd = robot.with_frames(robot.base, {f"t{k}": (0.0, 0.0, 0.001 * k) for k in range(1, 30)})
    planned = replace(planned, made=replace(planned.made, robot=crowd))
    planned.save(tmp_path)
    assert 'all 29<span class="box">' in (tmp_path / "sheet.html").read_text()


@pytest.mark.parametrize("name", ["rs007l", "puma560"])
def test_a_robot_whose_language_is_none_of_these_has_a_sheet_too(name: str, tmp_path: Path) -> None:
    out = tmp_path / "plan.csv"
    planned = truearm.plan(name, poses=10, candidates=30, no_floor=True, clearance=0.0, out=out)
    sheet = (tmp_path / "plan-sheet.html").read_text()
    assert f"Plan {hash_of(out.read_bytes())[:12]}: 10 configurations, joint positions " in sheet
    assert ("as the controller shows them" in sheet) == (name == "rs007l")
    assert ("of the model: nobody said how the controller counts them" in sheet) == (name == "puma560")
    rows = sheet.split("Configurations, in the order of the plan")[1]
    shown = planned.made.robot.controller.from_model(planned.joints)
    for value in np.degrees(shown).ravel():
        assert f'<td class="joints">{round(value, 2) + 0.0:.2f}</td>' in rows
    assert "(tool-assumed):</strong> Nobody said the targets" in sheet


def test_what_a_device_reads_stands_on_the_sheet(planned: Plan, tmp_path: Path) -> None:
    reads = tuple(f"ball from anchor {k}" for k in range(10))
    planned = replace(planned, made=replace(planned.made, reads=reads))
    planned.save(tmp_path)
    sheet = (tmp_path / "sheet.html").read_text()
    assert "<th>Reads</th>" in sheet
    assert "<td>ball from anchor 9</td>" in sheet


@pytest.mark.parametrize("label", ["a;PAUSE", 'a"b', "x" * 22, "P\u00e9", " a", "a\nb", ""])
def test_labels_that_no_comment_can_have_are_refused(label: str) -> None:
    with pytest.raises(InputError, match="a configuration cannot be called so in a program") as refusal:
        wanted().check_labels([label])
    assert refusal.value.parameter == "candidates_from"
    wanted().check_labels(["P 001", "2026-11-23_a.1", "x" * 21])


def test_a_folder_of_another_result_or_a_file_is_no_place(planned: Plan, folder: Path, tmp_path: Path) -> None:
    for out, name, words in (
        (tmp_path / "plan.csv", "", "a plan with a program needs a folder"),
        (tmp_path, "sheet.html", "was not written here by truearm"),
        (tmp_path, "MEASURE.mod", "was not written here by truearm"),
    ):
        if name:
            (tmp_path / name).write_text("mine")
        with pytest.raises(InputError, match=words) as refusal:
            truearm.plan("irb120", **QUICK, program="rapid", out=out)
        assert refusal.value.parameter == "out"
        assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [(name, "mine")] * bool(name)
        (tmp_path / (name or "none")).unlink(missing_ok=True)
    # and programs of two plans never stand in one folder
    with pytest.raises(InputError, match=r"the program of another plan is there.*got 'MEASURE\.mod'") as refusal:
        refuse_other_programs(folder, ["MEASURE.src"])
    assert refusal.value.parameter == "out"
    refuse_other_programs(folder, ["MEASURE.mod"])


def test_a_load_above_the_rated_one_is_warned_of() -> None:
    robot = replace(truearm.load_robot("irb120"), rated_load=3.0)
    written = truearm.plan(robot, **QUICK, program="rapid", payload="9kg,0mm,0mm,60mm").program
    assert written is not None
    (notice,) = [warning for warning in written.warnings if warning.code == "overload"]
    assert notice.level == "warning"
    assert "carries 9 kg" in notice.message
    assert "rated for 3 kg" in notice.message
