"""New programs of a path: every language's own reader finds the targets again."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from tests.compensation.workplace import cell

from truearm.compensation.corrected_path import CorrectedPath, correct_path, path_program
from truearm.compensation.program_correction import commanded
from truearm.engine.base.errors import InputError
from truearm.engine.motion.path_file import read_path
from truearm.engine.programs import BY_NAME
from truearm.engine.programs.cell import Cell, read_tools
from truearm.engine.programs.new_program import NewProgram
from truearm.engine.programs.program import MARK, Program, Source
from truearm.engine.programs.program_files import program_files
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot

PATH = """\
truearm: truearm-path/1
units: {length: mm, angle: deg, time: s}
tip: [0, 0, 100]
orientation: {quaternion: [0, 1, 0, 0]}
speed: 100
acceleration: 500
step: 0.05
start: [350, 0, 250]
sections:
  - line: [350, 100, 250]
  - {circle: [[400, 150, 250], [350, 200, 250]], speed: 50}
"""
CELL = 'tools: {"0": {of: flange, controller: {}}, tcp: {of: flange, controller: {}}}\n'
POSTURES = {
    "front-up": [0.0, 10.0, 10.0, 0.0, 60.0, 0.0],
    "turned": [0.0, 10.0, 10.0, 150.0, -60.0, -150.0],
    "flipped": [0.0, 15.0, 23.0, 180.0, -52.0, 0.0],
}


def calibrated(name: str = "irb120") -> Robot:
    robot = load_robot(name)
    rng = np.random.default_rng(2)
    drawn = {
        p.name: p.value + 0.5 * p.prior * rng.standard_normal()
        for p in robot.parameters.values()
        if p.group == "geometry"
    }
    return robot.with_values(drawn)


@pytest.fixture(scope="module")
def paths(tmp_path_factory: pytest.TempPathFactory) -> dict[str, CorrectedPath]:
    file = tmp_path_factory.mktemp("new") / "path.yaml"
    file.write_text(PATH)
    return {name: correct_path(calibrated(), read_path(file), np.radians(near)) for name, near in POSTURES.items()}


def texts(name: str, program: NewProgram) -> dict[Path, str]:
    language = BY_NAME[name]
    assert language.new is not None
    return {Path(file): text for file, text in language.new(program).items()}


def read_again(name: str, program: NewProgram) -> Program:
    sources = [Source(file, text) for file, text in texts(name, program).items()]
    assert all(source.text.isascii() for source in sources)
    assert all(BY_NAME[name].recognizes(source.text) for source in sources)
    return BY_NAME[name].read(sources)


def test_the_own_reader_finds_every_target_again(paths: dict[str, CorrectedPath]) -> None:
    for name, kind in product(BY_NAME, ("joints", "poses")):
        program = path_program(paths["front-up"], calibrated(), "weld_1", targets=kind, spacing=0.3)  # type: ignore[arg-type]
        result = read_again(name, program)
        assert result.skipped == (), (name, kind)
        assert len(result.targets) == len(result.moves) == len(program), (name, kind)
        assert [move.target for move in result.moves] == [*range(len(program))], (name, kind)
        straight = ["joint", *[{"joints": "joint", "poses": "linear"}[kind]] * (len(program) - 1)]
        assert [move.kind for move in result.moves] == straight, (name, kind)
        for row, target in enumerate(result.targets):
            form, values = target.form, np.array(target.values)
            if form.kind == "joints":
                assert values * form.angle == pytest.approx(program.joints[row], abs=1e-6), (name, kind)
                continue
            assert program.poses is not None, (name, kind)
            assert form.orientation is not None, (name, kind)
            assert values[:3] * form.length == pytest.approx(program.poses[row, :3, 3], abs=1e-6), (name, kind)
            numbers = values[None, 3:] * (1.0 if form.orientation.count == 4 else form.angle)
            assert form.orientation.matrices(numbers)[0] == pytest.approx(program.poses[row, :3, :3], abs=2e-6), (
                name,
                kind,
            )


def test_the_controller_takes_the_posture_that_was_meant(paths: dict[str, CorrectedPath], tmp_path: Path) -> None:
    for name, posture in product(BY_NAME, POSTURES):
        robot = calibrated()
        program = path_program(paths[posture], robot, "weld", targets="poses", spacing=0.5)
        tools = read_tools(robot, cell(tmp_path, CELL))
        went = commanded(robot, read_again(name, program), Cell(tools, {}))
        assert robot.controller.from_model(went) == pytest.approx(program.joints, abs=2e-5), (name, posture)


def test_an_arm_of_five_joints_has_programs_of_joint_positions(tmp_path: Path) -> None:
    katana, file = load_robot("katana450"), tmp_path / "path.yaml"
    file.write_text(
        "truearm: truearm-path/1\nunits: {length: mm, angle: deg, time: s}\ntip: [0, 0, 130]\nspeed: 100\n"
        "acceleration: 500\nstep: 0.1\nstart: [0, -370, 210]\nsections:\n  - line: [50, -370, 210]\n"
    )
    program = path_program(correct_path(katana, read_path(file)), katana, "weld", targets="joints", spacing=0.2)
    for name in BY_NAME:
        result = read_again(name, program)
        assert len(result.targets) == len(program), name
        for target, joints in zip(result.targets, program.joints, strict=True):
            assert np.array(target.values)[:5] * target.form.angle == pytest.approx(joints, abs=1e-6), name
            assert not any(target.values[5:]), name


def test_targets_are_some_time_apart_and_ends_of_sections_are_among_them(paths: dict[str, CorrectedPath]) -> None:
    path = paths["front-up"]
    program = path_program(path, calibrated(), "weld", targets="joints", spacing=0.25)
    assert program.durations[1:] == pytest.approx(0.25, abs=0.06)
    assert program.durations.sum() == pytest.approx(path.motion.time[-1])
    ends = [int(np.flatnonzero(path.planned.section == number)[-1]) for number in (1, 2)]
    for end in ends:
        position = calibrated().controller.from_model(path.joints["geometry"][end : end + 1])
        assert np.abs(program.joints - position).max(axis=1).min() < 1e-12
    assert program.blend(0) == program.blend(len(program) - 1) == 0.0
    assert 0.0 < program.blend(3) <= 1e-3


def test_speed_or_time_stands_in_the_program(paths: dict[str, CorrectedPath]) -> None:
    program = {
        kind: path_program(paths["front-up"], calibrated(), "weld", targets=kind, spacing=0.2)
        for kind in ("joints", "poses")
    }
    for name, kind, words in (
        ("rapid", "joints", "\\T:=0.2"),
        ("rapid", "poses", "\\T:=0.2"),
        ("fanuc-ls", "joints", "200msec"),
        ("fanuc-ls", "poses", "100.0mm/sec"),
        ("urscript", "joints", "t=0.2"),
        ("krl", "poses", "$VEL.CP = 0.1000"),
        ("inform", "poses", "V=100.0"),
        ("val3", "poses", "mPath.tvel=100.0"),
    ):
        assert words in "\n".join(texts(name, program[kind]).values()), (name, kind)


def test_a_corrected_program_is_not_corrected_again(paths: dict[str, CorrectedPath], tmp_path: Path) -> None:
    for name in BY_NAME:
        program = path_program(paths["front-up"], calibrated(), "weld", targets="joints", spacing=0.5)
        marked = [(tmp_path / file.name, text) for file, text in texts(name, program).items() if MARK in text]
        for file, text in marked:
            file.write_text(text)
        with pytest.raises(InputError, match="corrected already; got \"the comment 'corrected by truearm"):
            program_files([file for file, _ in marked])
        assert MARK not in "".join(texts(name, replace(program, corrected=False)).values()), name


def test_what_cannot_be_a_program_is_refused(paths: dict[str, CorrectedPath]) -> None:
    path = paths["front-up"]
    with pytest.raises(InputError, match="cannot be called so in every language; got '2nd'"):
        path_program(path, calibrated(), "2nd", targets="joints", spacing=0.2)
    katana = load_robot("katana450")
    with pytest.raises(InputError, match="arms of six joints"):
        path_program(path, katana, "weld", targets="poses", spacing=0.2)
    nameless = replace(path_program(path, calibrated(), "weld", targets="poses", spacing=0.5), branches=None)
    for name in ("fanuc-ls", "inform"):
        with pytest.raises(InputError, match="the postures of this arm have no names"):
            read_again(name, nameless)
    assert len(read_again("rapid", nameless).targets) == len(nameless)


def test_how_far_a_program_leaves_a_circle_between_its_targets_is_known(paths: dict[str, CorrectedPath]) -> None:
    wide = path_program(paths["front-up"], calibrated(), "weld", targets="poses", spacing=0.4)
    speed, radius = 0.05, 0.05
    assert wide.beside == pytest.approx((0.4 * speed) ** 2 / (8 * radius), rel=0.3)  # targets are samples
    narrow = path_program(paths["front-up"], calibrated(), "weld", targets="poses", spacing=0.1)
    assert narrow.beside < 0.15 * wide.beside
    every = path_program(paths["front-up"], calibrated(), "weld", targets="poses", spacing=0.05)
    assert every.beside < 1e-9
    assert len(every) == len(paths["front-up"].motion.time)
    turning = path_program(paths["front-up"], calibrated(), "weld", targets="joints", spacing=0.4)
    assert 0.0 < turning.beside < 2.0 * wide.beside
