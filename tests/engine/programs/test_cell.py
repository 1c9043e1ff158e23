"""Files that say where tools and frames really are."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from truearm.engine.base.errors import InputError
from truearm.engine.programs import LANGUAGES
from truearm.engine.programs.cell import Cell, read_frames, read_known_places, read_tools
from truearm.engine.programs.program import Language
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform

HEAD = "truearm: truearm-cell/1\nunits: {length: mm, angle: deg}\n"


def robot() -> Robot:
    """Return a robot that stands a quarter turn about z from the instrument, with a reflector on its flange."""
    half = math.sqrt(0.5)
    base = Transform((1.0, 2.0, 0.5), (half, 0.0, 0.0, half))
    return load_robot("irb120").with_frames(base, {"1": (0.01, 0.02, 0.125)})


def read(tmp_path: Path, text: str) -> Cell:
    file = tmp_path / "cell.yaml"
    file.write_text(HEAD + text)
    tools = read_tools(robot(), file if "tools" in text else None)
    return Cell(tools, read_frames(robot(), file if "frames" in text else None))


def test_a_frame_in_the_world_is_seen_from_the_base(tmp_path: Path) -> None:
    cell = read(tmp_path, "frames:\n  wobjTable: {of: world, translation: [1000, 2300, 500]}\n")
    placed = cell.frames["wobjtable"]
    assert placed.controller is None
    assert placed.identified is not None
    # 300 mm along the world's y are 300 mm along the x of a base that is turned to the left.
    np.testing.assert_allclose(placed.identified.translation, [0.3, 0.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(placed.identified.rotation @ [0, 1, 0], [1, 0, 0], atol=1e-15)


def test_names_of_tools_and_frames(tmp_path: Path) -> None:
    """Own base and flange have none, and a number is one."""
    cell = read(
        tmp_path,
        "tools:\n  flange: {of: flange}\n  3: {of: flange}\n"
        '  tProbe: {of: flange, target: "1", controller: {translation: [0, 0, 125]}}\n'
        "frames:\n  Base: {of: base, translation: [1, 2, 3]}\n  2: {of: base}\n",
    )
    assert (list(cell.tools), list(cell.frames)) == (["", "3", "tprobe"], ["", "2"])
    assert cell.tools[""].identified == Transform()
    assert cell.frames[""].identified == Transform((0.001, 0.002, 0.003))
    assert cell.tools["tprobe"].identified == Transform((0.01, 0.02, 0.125))
    assert cell.tools["tprobe"].controller == Transform((0.0, 0.0, 0.125))


#: What each language calls the flange and the base, besides `flange` and `base`; from its maker's manuals.
OWN = {
    "RAPID": (["tool0", "TOOL0"], ["wobj0"]),
    "KRL": (["0", "$NULLFRAME"], ["0", "$NULLFRAME", "$WORLD", "$ROBROOT"]),
    "FANUC LS": (["0"], ["0"]),
    "URScript": ([], []),
    "INFORM": ([], ["ROBOT"]),
    "VAL3": ([], ["world"]),
}


@pytest.mark.parametrize("language", LANGUAGES, ids=lambda language: language.name)
def test_own_base_and_flange_are_called_as_the_language_calls_them(tmp_path: Path, language: Language) -> None:
    file = tmp_path / "cell.yaml"
    flange, base = OWN[language.name]
    for name in ["flange", *flange]:
        file.write_text(f'{HEAD}tools:\n  "{name}": {{of: flange, translation: [0, 0, 1]}}\n')
        assert list(read_tools(robot(), file, language.flange)) == [""]
    for name in ["base", *base]:
        file.write_text(f'{HEAD}frames:\n  "{name}": {{of: world}}\n')
        assert list(read_frames(robot(), file, language.base)) == [""]
    # In another language it is the name of any tool; tool 0 of a Yaskawa is a tool like the others.
    file.write_text(f'{HEAD}tools:\n  "0": {{of: controller}}\n  tool0: {{of: controller}}\n  myTool: {{of: flange}}\n')
    if "0" in language.flange or "tool0" in language.flange:
        with pytest.raises(InputError, match="its own flange at zero"):
            read_tools(robot(), file, language.flange)
    else:
        assert list(read_tools(robot(), file, language.flange)) == ["0", "tool0", "mytool"]


def test_two_names_of_one_flange_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "cell.yaml"
    file.write_text(f"{HEAD}tools:\n  tool0: {{of: flange}}\n  flange: {{of: flange, translation: [0, 0, 1]}}\n")
    assert set(read_tools(robot(), file)) == {"tool0", ""}
    with pytest.raises(InputError, match="own flange is given twice; got 'tool0 and flange'") as refusal:
        read_tools(robot(), file, ("tool0",))
    assert refusal.value.where == f"{file}, tools.flange"
    file.write_text(f'{HEAD}frames:\n  "0": {{of: base}}\n  $World: {{of: base}}\n')
    with pytest.raises(InputError, match=r"own base is given twice; got '0 and \$World'"):
        read_frames(robot(), file, ("0", "$world"))


def test_a_target_that_is_a_point_may_be_given_an_orientation(tmp_path: Path) -> None:
    cell = read(tmp_path, 'tools:\n  t: {of: flange, target: "1", wpr: [0, 90, 0]}\n')
    placed = cell.tools["t"].identified
    assert placed is not None
    assert placed.translation == (0.01, 0.02, 0.125)
    np.testing.assert_allclose(placed.rotation @ [0, 0, 1], [1, 0, 0], atol=1e-12)
    (known,) = read_known_places(robot(), tmp_path / "cell.yaml")[0].values()
    assert (known.place, known.turned) == (placed, True)


def test_orientations_as_each_maker_writes_them(tmp_path: Path) -> None:
    for entry, column in (
        ("quaternion: [0, 1, 0, 0]", [0, 0, -1]),
        ("wpr: [180, 0, 0]", [0, 0, -1]),
        ("abc: [0, 90, 0]", [1, 0, 0]),
        ("rxryrz: [90, 0, 90]", [0, -1, 0]),
        ("rotation_vector: [0, 180, 0]", [0, 0, -1]),
    ):
        cell = read(tmp_path, f"tools:\n  t: {{of: controller, translation: [0, 0, 100], {entry}}}\n")
        placed = cell.tools["t"]
        assert placed.identified is None, entry
        assert placed.controller is not None, entry
        np.testing.assert_allclose(placed.controller.matrix[:3, 2], column, atol=1e-12)
        np.testing.assert_allclose(placed.controller.matrix[:3, 3], [0, 0, 0.1])


def test_what_is_wrong_is_said(tmp_path: Path) -> None:
    for text, said in (
        ("frames: {}\n", "has no frames"),
        ("tools:\n  t: {of: world}\n", "got 'world'; allowed: flange, controller"),
        ("frames:\n  f: {of: flange}\n", "got 'flange'; allowed: world, base, controller"),
        ("frames:\n  f: {of: base, wpr: [0, 0, 0], abc: [0, 0, 0]}\n", "one orientation belongs here"),
        ("frames:\n  f: {of: base, quaternion: [1, 1, 0, 0]}\n", "must have length 1"),
        ("frames:\n  f: {of: base, translation: [1, 2]}\n", "f.translation"),
        ("frames:\n  f: {of: base, translation: [1.0e+10, 2, 3]}\n", "f.translation"),
        ("frames:\n  f: {of: base, turn: 3}\n", "not known here"),
        ('tools:\n  t: {of: flange, target: "7"}\n', "no target of this name"),
        ('tools:\n  t: {of: controller, target: "1"}\n', "a target is on the identified flange"),
        ('tools:\n  t: {of: flange, target: "1", translation: [0, 0, 9]}\n', "the target says where the tool is"),
        ("frames:\n  T: {of: base}\n  t: {of: base}\n", "this name is given twice"),
        ("frames:\n  base: {of: controller, translation: [0, 0, 1]}\n", "its own base at zero"),
        ("tools:\n  flange: {of: flange, controller: {translation: [0, 0, 1]}}\n", "its own flange at zero"),
        ("tools:\n  t: {of: controller, controller: {translation: [0, 0, 1]}}\n", "says what the controller has"),
    ):
        with pytest.raises(InputError, match=said):
            read(tmp_path, text)
