"""Known frames are held: absolute calibration, what it says of itself, and what cannot be held."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.known_frames import frames_of
from tests.plate import PLATE
from tests.simulated import campaign
from typer.testing import CliRunner

from truearm.calibration.calibrate import calibrate
from truearm.calibration.result import Calibration
from truearm.commands import program
from truearm.compensation.program_correction import CorrectedPrograms, corrected_programs
from truearm.engine.base.errors import InputError
from truearm.engine.command.loading import load_robot
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import FRAMES, named_model
from truearm.engine.fit.problem import gauge_freedoms
from truearm.engine.programs.cell import EMPTY_CELL
from truearm.engine.programs.chosen_targets import Choice
from truearm.engine.programs.fake_targets import matrices
from truearm.engine.programs.gauge import best_agreement
from truearm.engine.programs.program import Source
from truearm.engine.programs.rapid import RAPID
from truearm.engine.robot.library import load_robot as library_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure
from truearm.simulation.jobs import simulate
from truearm.validation.jobs import validate

GEOMETRIC = named_model("geometric")


@cache
def exact(robot: str = "irb120") -> tuple[Twin, Dataset]:
    return campaign(robot, 30, 0.0, 11)


@cache
def noisy() -> tuple[Twin, Dataset]:
    return campaign("irb120", 30, 0.05e-3, 11)


def apart(first: Robot, other: Robot, target: str | None = None) -> float:
    """Return how far two robots are from each other in the instrument's frame, at most [m]."""
    q = first.random_configurations(60, np.random.default_rng(5))
    return float(np.abs(first.world_poses(q, target)[0] - other.world_poses(q, target)[0]).max())


#: What was calibrated with what held: several tests read the same calibration.
_CALIBRATED: dict[object, Calibration] = {}


def calibrated_holding(hold: list[str], folder: Path, robot: str = "irb120", **more: Any) -> Calibration:
    key = (robot, *hold, *more.items())
    if key not in _CALIBRATED:
        twin, data = exact(robot)
        frames = frames_of(twin.robot, folder / "frames.yaml")
        _CALIBRATED[key] = calibrate(robot, data, hold=hold, frames=frames, **{"model": "geometric", **more})
    return _CALIBRATED[key]


@pytest.mark.parametrize(("robot", "redundancy"), [("irb120", "prior"), ("irb120", "drop"), ("katana450", "prior")])
def test_with_true_frames_the_flange_is_where_it_is(robot: str, redundancy: str, tmp_path: Path) -> None:
    """Base and tool known: not only the targets, the flange itself stands right in the base."""
    result = calibrated_holding(["base", "targets"], tmp_path, robot, redundancy=redundancy)
    twin = exact(robot)[0].robot
    assert result.warnings == () or {n.code for n in result.warnings} <= {"redundant", "parallel-axes"}
    assert all(apart(result.robot, twin, target.name) < 1e-9 for target in twin.targets)
    assert apart(result.robot, twin) < 1e-9
    free = identify(library_robot(robot), exact(robot)[1], GEOMETRIC, redundancy=redundancy)  # type: ignore[arg-type]
    assert all(apart(free.robot, twin, target.name) < 1e-9 for target in twin.targets)
    assert apart(free.robot, twin) > 1e-4  # shifts of base and flange are arbitrary there
    if (robot, redundancy) == ("irb120", "drop"):
        # The height of the base is no longer redundant with the first joint.
        dropped, still = ({r.dropped for r in fit.redundancies} for fit in (free, result.fit))
        gauge = {name for name in dropped if name.rsplit("_", 1)[-1] in ("1", "6")}
        assert gauge
        assert not still & gauge
        assert {"d_1", "theta_offset_1"} <= set(result.fit.free.names)


def test_what_is_held_stays_and_the_rest_is_found(tmp_path: Path) -> None:
    for hold in (["base"], ["targets"], ["1"], ["base", "2"]):
        result = calibrated_holding(hold, tmp_path)
        twin = exact()[0].robot
        assert result.nominal.position is not None, hold
        assert all(apart(result.robot, twin, target.name) < 1e-9 for target in twin.targets), hold
        names = result.fit.fixed.names(result.robot)
        assert names, hold
        for name in names:
            if not name.startswith("base_r"):
                assert result.robot.values[name] == pytest.approx(twin.values[name], abs=1e-12), hold
            assert result.fit.parameter_status(name) == "held", hold
            assert result.robot.parameters[name].deviation is None, hold


def test_what_was_held_is_said_everywhere(tmp_path: Path) -> None:
    outcome = calibrated_holding(["base", "1", "2", "3"], tmp_path, out=tmp_path / "out")
    assert "Held at known places: base, target 1, target 2, target 3" in outcome.lines()
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    assert result["held"] == ["base", "target 1", "target 2", "target 3"]
    assert {p["status"] for p in result["parameters"] if p["name"].startswith("base_")} == {"held"}
    assert "held at known places" in (tmp_path / "out" / "report.html").read_text()
    assert ", base, 1, 2 and 3 held" in outcome.history or "base, 1, 2, 3 held" in outcome.history
    assert "hold=['base', '1', '2', '3']" in outcome.command
    path = tmp_path / "out" / "calibrated.yaml"
    again = load_robot(path)
    assert again.proof is not None
    assert again.proof.held[:2] == ("base", "flange")
    assert "target_1_x" in again.proof.held
    shown = CliRunner().invoke(program(), ["show", str(path)]).output
    assert "held at known places: base, flange" in " ".join(shown.split())
    assert outcome.expected.frame == "the instrument's frame"
    path.write_text(path.read_text().replace("held: [base", "held: [bass"))
    with pytest.raises(InputError, match=r"proof\.held: nothing of this name can be held; got 'bass'"):
        load_robot(path)


def test_the_base_stays_known_when_the_robot_is_placed_anew(tmp_path: Path) -> None:
    first = calibrated_holding(["base", "targets"], tmp_path)
    elsewhere = calibrate(first.robot, exact()[1], model="frames")
    assert elsewhere.robot.proof is not None
    assert elsewhere.robot.proof.held == ("base", "flange")
    assert calibrate(first.robot, exact()[1], model="geometric").robot.proof.held == ()  # type: ignore[union-attr]


def test_no_base_and_no_flange_is_assumed_in_programs_where_they_were_held(tmp_path: Path) -> None:
    def corrected(robot: Robot) -> CorrectedPrograms:
        plate = RAPID.read([Source(Path("plate.mod"), PLATE)])
        return corrected_programs(robot, [plate], EMPTY_CELL, choice=Choice(taught=frozenset()))

    result = corrected(calibrated_holding(["base", "targets"], tmp_path).robot)
    assert (result.frames.tools, result.frames.frames) == ("held", "held")
    np.testing.assert_allclose(result.frames.base, np.eye(4), atol=0)
    np.testing.assert_allclose(result.frames.flange, np.eye(4), atol=0)
    correction, twin = result.corrections[0], exact()[0].robot
    rows = np.flatnonzero(correction.corrected)
    tool = next(iter(correction.program.tools.values())).matrix
    # Sent there, the twin is in its own base where the program means it, which a shift of the base would spoil.
    reached = np.linalg.inv(twin.base.matrix) @ matrices(twin, correction.joints[rows]) @ tool
    np.testing.assert_allclose(reached, correction.tips[rows], atol=1e-7)
    assert correction.moved[rows].mean() > 1e-4
    other = corrected(identify(library_robot("irb120"), exact()[1], GEOMETRIC).robot)
    assert (other.frames.tools, other.frames.frames) == ("assumed", "assumed")
    assert not np.allclose(other.frames.base, np.eye(4), atol=1e-6)


def test_a_tool_point_that_was_held_stays_on_the_flange_in_programs(tmp_path: Path) -> None:
    robot = calibrated_holding(["base", "1"], tmp_path).robot
    base, flange = best_agreement(robot)
    np.testing.assert_allclose(base, np.eye(4), atol=0)
    point = np.array([robot.values[f"target_1_{axis}"] for axis in "xyz"])
    np.testing.assert_allclose((flange @ [*point, 1.0])[:3], point, atol=2e-6)
    assert not np.allclose(flange[:3, :3], np.eye(3), atol=1e-6)


def test_a_base_that_is_elsewhere_contradicts_the_readings(tmp_path: Path) -> None:
    twin, data = noisy()
    right = calibrate(
        "irb120", data, hold=["base"], frames=frames_of(twin.robot, tmp_path / "a.yaml"), model="geometric"
    )
    assert "hold-contradicts" not in {n.code for n in right.warnings}
    wrong = frames_of(twin.robot, tmp_path / "b.yaml", base=(2.0, 0.0, 0.0))
    for redundancy in ("prior", "drop"):
        result = calibrate(
            "irb120", data, hold=["base", "targets"], frames=wrong, redundancy=redundancy, model="geometric"
        )
        (notice,) = [n for n in result.warnings if n.code == "hold-contradicts"]
        assert notice.level == "error"
        assert re.search(r"with them the fit leaves \S+ mm .* with all of them found 0\.08\d* mm", notice.message)
        assert not result.finished
    # A height that only another robot could have goes whole into d_1, and no reading is off.
    wrong = frames_of(twin.robot, tmp_path / "b.yaml", base=(0.0, 0.0, 12.0))
    result = calibrate("irb120", data, hold=["base"], frames=wrong, model="geometric")
    (notice,) = [n for n in result.warnings if n.code == "hold-contradicts"]
    assert re.search(r"found from the readings, the base is 1\d\.\d mm", notice.message)


def test_a_moved_base_and_held_targets_go_together(tmp_path: Path) -> None:
    twin, data = noisy()
    numbered = replace(data, number=np.arange(30.0))
    position = numbered.position.copy()
    position[numbered.configuration >= 15] += [2e-3, 0.0, 1e-3]
    frames = frames_of(twin.robot, tmp_path / "frames.yaml")
    result = calibrate(
        "irb120",
        replace(numbered, position=position),
        hold=["base", "targets"],
        frames=frames,
        base_changes=["16"],
        model="geometric",
    )
    assert apart(result.robot, twin.robot) < 0.3e-3


@cache
def touched(device: str = "plane") -> tuple[Robot, Dataset]:
    data = simulate("irb120", truth="nominal", device=device, poses=30, noise=0.0, seed=1).data
    return identify(library_robot("irb120"), data, FRAMES).robot, data


def cell_file(path: Path, tools: dict[str, Any], frames: dict[str, Any]) -> Path:
    units = {"length": "mm", "angle": "deg"}
    path.write_text(json.dumps({"truearm": "truearm-cell/1", "units": units, "tools": tools, "frames": frames}))
    return path


def fixture_entries(robot: Robot) -> dict[str, Any]:
    entries = {}
    for fixture in robot.fixtures:
        kinematics = robot.fixture_kinematics(fixture.name)
        place = Transform.from_matrix(kinematics.matrix()[0], kinematics.position[:, 0])
        translation = [1e3 * v for v in place.translation]
        entries[fixture.name] = {"of": "base", "translation": translation, "quaternion": list(place.quaternion)}
    return entries


def test_fixtures_that_are_held_locate_the_robot(tmp_path: Path) -> None:
    robot, data = touched()
    frames = cell_file(tmp_path / "cell.yaml", {}, fixture_entries(robot))
    result = calibrate("irb120", data, model="offsets", train="all", hold=["fixtures"], frames=frames)
    assert result.fit.gauge_freedoms == ()
    assert "closed-loop" not in {n.code for n in result.warnings}
    assert all(
        result.fit.parameter_status(p.name) == "held" for p in result.robot.parameters.values() if p.group == "fixture"
    )
    assert gauge_freedoms(data)
    assert apart(result.robot, robot, result.robot.targets[0].name) < 1e-6


TOOL = {"of": "flange", "translation": [0, 0, 100]}
BASE = {"of": "world", "translation": [0, 0, 0], "quaternion": [1, 0, 0, 0]}


HOLDS: list[tuple[list[str], dict[str, Any], dict[str, Any], str]] = [
    (["bse"], {}, {"base": BASE}, r"nothing of this name to hold; got 'bse'.*Did you mean base"),
    (["base", "base", "1", "targets"], {}, {}, r"this is held twice; got 'targets \(1\)'"),
    (["fixtures"], {}, {"base": BASE}, r"the readings have no fixture"),
    (["base"], {"1": TOOL}, {}, r"frames\.yaml, frames: base is held, and the file does not say where"),
    (["targets"], {"1": TOOL}, {}, r"frames\.yaml, tools: 2 is held, .* got '1'"),
    (["base"], {}, {"base": {**BASE, "of": "controller"}}, r"frames\.base: where the controller has it does not say"),
    (["base"], {}, {"base": {**BASE, "of": "base"}}, r"frames\.base: where the base stands has to be said in the"),
    (["base"], {}, {"base": {"of": "world"}}, r"frames\.base: the base has an orientation, .*quaternion: \[1, 0"),
]


def test_contradicting_holds_are_refused(tmp_path: Path) -> None:
    for hold, tools, frames, words in HOLDS:
        path = cell_file(tmp_path / "frames.yaml", tools, frames)
        with pytest.raises(InputError, match=words):
            calibrate("irb120", exact()[1], hold=hold, frames=path)


def test_holds_that_do_not_go_with_the_rest_are_refused(tmp_path: Path) -> None:
    frames, bounds = frames_of(exact()[0].robot, tmp_path / "f.yaml"), tmp_path / "bounds.yaml"
    bounds.write_text("truearm: truearm-bounds/1\nunits: {length: mm, angle: deg}\nwithin: {base_x: 1}\n")
    alone, together = "nothing of this name to hold; got 'curve_sin99_1'", "this is not made with places that are held"
    cases: tuple[tuple[dict[str, Any], str], ...] = (
        ({"hold": ["base", "targets"]}, "what is held has no numbers; got 'base, targets'"),
        ({"hold": ["curve_sin99_1"]}, f"{alone}; allowed: base, targets"),
        ({"frames": frames}, "frames are given, and nothing is held at them"),
        ({"hold": "base", "frames": frames}, "a sequence of names belongs here"),
        ({"hold": ["base", "targets"], "frames": frames, "model": "frames"}, "nothing to find; got 'model frames'"),
        ({"hold": ["base"], "frames": frames, "bounds": bounds}, "has bounds, and it is held; got 'base_x'"),
        ({"hold": ["base"], "frames": frames, "zones": 2}, together),
        ({"hold": ["base"], "frames": frames, "monte_carlo": 100}, together),
        ({"monte_carlo": 100, "bootstrap": 20}, "not with those of a bootstrap"),
    )
    for value, words in cases:
        with pytest.raises(InputError, match=words):
            calibrate("irb120", exact()[1], **{"model": "geometric", **value})


def test_what_readings_of_fixtures_cannot_hold_is_refused(tmp_path: Path) -> None:
    robot, data = touched()
    entries = fixture_entries(robot)
    name = next(iter(entries))
    only_base = cell_file(tmp_path / "b.yaml", {}, {"base": BASE})
    with pytest.raises(InputError, match=r"no reading says where the base stands"):
        calibrate("irb120", data, hold=["base"], frames=only_base)
    in_world = cell_file(tmp_path / "w.yaml", {}, {**entries, name: {**entries[name], "of": "world"}})
    with pytest.raises(InputError, match=r"the world is the robot's base; got 'of: world'; allowed: of: base"):
        calibrate("irb120", data, hold=["fixtures"], frames=in_world)
    flat = cell_file(tmp_path / "f.yaml", {}, {**entries, name: {"of": "base", "translation": [0, 0, 0]}})
    with pytest.raises(InputError, match=rf"fixture {name} has an orientation"):
        calibrate("irb120", data, hold=["fixtures"], frames=flat)


def test_a_robot_in_its_own_frame_takes_the_place_of_a_target_from_its_file(tmp_path: Path) -> None:
    tool = calibrated_holding(["base"], tmp_path, model="frames")  # a tool alone, in a base that is known
    assert set(tool.fit.free.names) == {f"target_{n}_{a}" for n in "123" for a in "xyz"}
    path = cell_file(tmp_path / "t.yaml", {n: {"of": "flange", "target": n} for n in "123"}, {})
    result = calibrate(tool.robot, exact()[1], hold=["targets"], frames=path, model="geometric")
    for name in ("target_1_x", "target_2_y", "target_3_z"):
        assert result.robot.values[name] == tool.robot.values[name]


def test_the_command_holds_as_the_job_does(tmp_path: Path) -> None:
    twin, data = exact()
    (tmp_path / "data.csv").write_text(csv_text(data))
    frames_of(twin.robot, tmp_path / "frames.yaml")
    words = ["calibrate", "irb120", str(tmp_path / "data.csv"), "--hold", "base, 1", "--hold", "2"]
    words += ["--out", str(tmp_path / "out")]
    outcome = CliRunner().invoke(program(), [*words, "--details", "--frames", str(tmp_path / "frames.yaml")])
    assert outcome.exit_code == 0, outcome.output
    assert "Held at known places: base, target 1, target 2" in outcome.output
    lacking = CliRunner().invoke(program(), words)
    assert str(lacking.exception).startswith("--hold: what is held has no numbers")
    assert str(lacking.exception).endswith("in a file with --frames.")
    validated = validate(tmp_path / "out" / "calibrated.yaml", data)
    assert validated.errors.position is not None
    assert validated.errors.position.mean < 1e-9


def test_a_held_base_that_the_arm_makes_up_for_is_told(tmp_path: Path) -> None:
    """3 mm along x go into a_1, which the readings alone do not tell from the base."""
    robot = library_robot("irb120")
    rng = np.random.default_rng(0)
    twin = truth_twin(robot, "nominal", rng)
    data = measure(twin, robot.random_configurations(40, rng), 0.03e-3, rng)
    frames = frames_of(twin.robot, tmp_path / "frames.yaml")
    right = calibrate(robot, data, hold=["base", "targets"], frames=frames, model="geometric")
    assert "hold-strained" not in {n.code for n in right.warnings}
    along_x = twin.robot.base.rotation @ [3e-3, 0.0, 0.0]
    moved = twin.robot.with_values(
        {f"base_{axis}": twin.robot.values[f"base_{axis}"] + float(v) for axis, v in zip("xyz", along_x, strict=True)}
    )
    wrong = calibrate(robot, data, hold=["base", "targets"], frames=frames_of(moved, frames), model="geometric")
    (notice,) = [n for n in wrong.warnings if n.code == "hold-strained"]
    assert notice.level == "warning"
    assert "a_1 (" in notice.message
