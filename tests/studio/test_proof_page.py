"""The page Proof: what a result is of, and errors that are those of its figures."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest
from tests.simulated import campaign
from tests.studio.conftest import Serving
from tests.studio.pressing import act, at_once, below, notices

from truearm.calibration.calibrate import calibrate
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import fitted_from
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.studio.cell_places import Thing, place_of, with_base, with_thing
from truearm.studio.pages.jog import JogPage
from truearm.studio.pages.programs import ProgramsPage
from truearm.studio.pages.proof import ProofPage
from truearm.studio.window import Window


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project with the calibration of a robot file."""
    folder = tmp_path_factory.mktemp("calibrated") / "project"
    folder.mkdir()
    (folder / "data.csv").write_text(csv_text(campaign("irb120", 24, 0.05e-3, 4)[1]))
    (folder / "arm.yaml").write_text(robot_text(load_robot("irb120")))
    (folder / "truearm-studio.yaml").write_text(
        "truearm: truearm-studio/1\nrobot: arm.yaml\ndata: data.csv\nmodel: offsets\n"
    )
    calibrate(folder / "arm.yaml", folder / "data.csv", model="offsets", out=folder / "result")
    return folder


@pytest.fixture
def window(calibrated: Path, serving: Serving, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Window:
    shutil.copytree(calibrated, tmp_path / "project")
    window = serving(tmp_path / "project").window
    at_once(window, monkeypatch)
    return window


def proof_of(window: Window) -> ProofPage:
    return next(page for page in window.pages if isinstance(page, ProofPage))


def edit_the_robot(window: Window, pattern: str, put: str) -> None:
    file = window.project.folder / "arm.yaml"
    text, count = re.subn(pattern, put, file.read_text(), count=1)
    assert count == 1
    file.write_text(text)
    window._reload()


def test_what_a_result_is_of_stands_on_the_page(window: Window) -> None:
    proof = proof_of(window)
    assert (
        "Of irb120, data.csv (trained on 17 of 24 configurations, seed 0), model offsets, loss linear, payload none, "
        "no reading excluded."
    ) in proof._table.content
    assert "other-" not in proof._now.content


def test_a_result_of_simulated_measurements_says_so_before_its_figures(window: Window) -> None:
    proof = proof_of(window)
    assert proof._table.content.count("SIMULATED: measurements of a virtual instrument, not of a robot.") == 1
    assert proof._table.content.index("SIMULATED:") < proof._table.content.index("Of irb120")
    file = window.project.folder / "result" / "result.json"
    text = file.read_text()
    file.write_text(text.replace('"simulated_parts": [\n    "data"\n  ],', ""))
    proof.refresh()
    assert "SIMULATED" not in proof._table.content
    file.write_text(text)


def test_a_robot_that_is_gone_does_not_make_the_result_none(window: Window) -> None:
    file = window.project.folder / "truearm-studio.yaml"
    file.write_text(file.read_text().replace("robot: arm.yaml", "robot: gone.yaml"))
    assert "gone.yaml" in file.read_text()
    window._reload()
    assert "gone.yaml" in window._notices.content
    assert "this is no result" not in window._notices.content


def test_other_settings_than_those_of_the_result_are_told(window: Window) -> None:
    proof = proof_of(window)
    window.edit(model="elastic", payload="2kg,0mm,0mm,50mm")
    assert "(other-settings)" in proof._now.content
    assert "made with model offsets; payload none. Chosen now: model elastic; payload 2kg,0mm,0mm,50mm." in (
        proof._now.content
    )
    assert "model offsets, loss linear, payload none" in proof._table.content
    window.edit(model="offsets", payload=None, train=17)
    assert "other-settings" not in proof._now.content
    window.edit(train="all", seed=2, loss="huber")
    assert "made with training part 17; seed 0; loss linear. Chosen now: training part 24; seed 2; loss huber" in (
        proof._now.content
    )
    window.edit(train=99, seed=0, loss="linear")
    assert "Chosen now: training part 99." in proof._now.content
    window.edit(train=None)
    assert "other-settings" not in proof._now.content
    edit_the_robot(window, "masses:", "gravity: [0, 0, 9.81]\nmasses:")
    assert "made with gravity 0,0,-9.80665. Chosen now: gravity 0,0,9.81." in proof._now.content


def test_readings_that_were_excluded_and_the_payload_stand_in_the_line(window: Window) -> None:
    folder = window.project.folder
    (folder / "excluded.csv").write_text("configuration,target,reason\n1,1,beam broken\n")
    calibrate(
        folder / "arm.yaml",
        folder / "data.csv",
        model="offsets",
        train="all",
        payload="1.3kg,1mm,2mm,3.7mm",
        exclude=folder / "excluded.csv",
        out=folder / "result",
    )
    window.edit(exclude="excluded.csv", train="all", payload="1300g,1mm,2mm,3.7mm")
    proof = proof_of(window)
    assert "trained on 24 of 24 configurations" in proof._table.content
    assert "payload 1.3kg,1mm,2mm,3.7mm, 1 reading excluded." in proof._table.content
    assert "other-" not in proof._now.content


def test_a_result_whose_history_is_written_otherwise_is_shown_with_what_it_says(window: Window) -> None:
    file = window.project.folder / "result/result.json"
    file.write_text(re.sub(r'"history": ".*"', '"history": "calibrated long ago"', file.read_text()))
    window._reload()
    proof = proof_of(window)
    assert "Of irb120, model offsets, payload none, no reading excluded." in proof._table.content
    window.edit(model="geometric", seed=3)
    assert "made with model offsets. Chosen now: model geometric." in proof._now.content
    window.edit(model=None)
    assert "made with model offsets. Chosen now: model by default." in proof._now.content
    content = file.read_text().replace('"name": "offsets",', '"name": "offsets", "because": "loads are known",')
    file.write_text(content)
    window._reload()
    assert "Chosen now: model" not in proof_of(window)._now.content


def test_an_edited_robot_of_the_same_name_is_another_robot(window: Window) -> None:
    proof = proof_of(window)
    (programs,) = (page for page in window.pages if isinstance(page, ProgramsPage))
    edit_the_robot(window, "a: 270.0", "a: 290.0")
    assert (
        "This result is of the robot irb120 with other kinematics, and irb120 (arm.yaml) is chosen"
        in proof._now.content
    )
    assert "(other-robot)" in proof._now.content
    (window.project.folder / "part.mod").write_text("MODULE m\nENDMODULE\n")
    window.edit(program="part.mod")
    act(programs._run)
    assert "the result is of another robot than the one that is chosen" in below(window, programs._run)
    act(proof._arrows._draw)
    assert "the result is of another robot than the one that is chosen" in below(window, proof._arrows._draw)
    edit_the_robot(window, "a: 290.0", "a: 270.0")
    assert "other-robot" not in proof._now.content


def test_errors_before_that_are_not_those_of_the_figures_are_not_drawn(
    window: Window, monkeypatch: pytest.MonkeyPatch
) -> None:
    proof = proof_of(window)
    (jog,) = (page for page in window.pages if isinstance(page, JogPage))
    monkeypatch.setattr(window, "refuse_result_of_another", lambda: None)
    edit_the_robot(window, "a: 270.0", "a: 290.0")
    act(proof._arrows._draw)
    assert "has other errors before the calibration than the result says" in below(window, proof._arrows._draw)
    assert not jog.scene._parts.get("errors")
    edit_the_robot(window, "a: 290.0", "a: 270.0")
    window.edit(loss="l1")  # the nominal robot is placed by it
    act(proof._arrows._draw)
    assert "has other errors before the calibration than the result says" in below(window, proof._arrows._draw)


def test_magnification_and_largest_error_stand_on_the_page_too(window: Window) -> None:
    arrows = proof_of(window)._arrows
    (jog,) = (page for page in window.pages if isinstance(page, JogPage))
    assert not arrows._said.visible
    act(arrows._draw)
    assert "has other errors" not in notices(window)
    assert arrows._said.visible
    for share in (1.0, 0.0):
        act(arrows._share, share)
        act(arrows._factor, 50.0)
        assert f"In the scene: {jog.scene._parts['errors'][1].text}." in arrows._said.content
    assert "errors x 50, largest " in arrows._said.content
    act(arrows._hide)
    assert not arrows._said.visible


def test_a_robot_with_other_things_around_it_is_the_same_one(window: Window) -> None:
    proof = proof_of(window)
    robot = with_base(load_robot("irb120"), (100.0, 2.0, 3.0), (0.0, 10.0, 90.0))
    for thing in (
        Thing("probe", "target", (1.0, 2.0, 3.0)),
        Thing("nest", "point", (500.0, 0.0, 0.0)),
        Thing("plate", "plane", (500.0, 0.0, 0.0), (5.0, 0.0, 0.0)),
    ):
        robot = with_thing(robot, thing)
    (window.project.folder / "irb120-cell.yaml").write_text(robot_text(robot))
    window.project.look()
    window.edit(robot="irb120-cell.yaml")
    assert "other-" not in proof._now.content
    window.edit(robot="irb120")
    assert "other-" not in proof._now.content
    window.edit(robot="result/calibrated.yaml")
    assert "other-robot" not in proof._now.content


def test_a_fit_is_of_the_robot_that_it_began_with(tmp_path: Path) -> None:
    nominal, data = load_robot("irb120"), campaign("irb120", 24, 0.05e-3, 4)[1]
    first = calibrate(nominal, data, model="offsets").robot
    second = calibrate(first, data, model="geometric", seed=1).robot
    other = calibrate(nominal, campaign("irb120", 24, 0.05e-3, 5)[1], model="offsets").robot
    assert all(fitted_from(second, robot) for robot in (nominal, first, second))
    assert not fitted_from(first, other)  # another arm of the same kind
    assert not fitted_from(first, load_robot("panda"))
    assert not fitted_from(first, load_robot("irb1200_7_0.7"))
    moved = nominal.with_frames(place_of((9.0, 9.0, 9.0), (0.0, 0.0, 3.0), "base"), {})
    assert fitted_from(first, moved.with_payload("2kg,0mm,0mm,50mm"))
