"""A program is not made worse in silence: what speaks against a correction is told, or it is refused."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Final

import numpy as np
import pytest
from tests.answered import ANSWERS
from tests.honesty.telling import Told, told, written
from tests.plate import PLATE
from tests.simulated import campaign

from truearm.engine.twin.twin import measure

NOISE: Final = 2e-5


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("programs")
    (made / "plate.mod").write_text(PLATE)
    return made


@cache
def robot(name: str, folder: Path) -> Path:
    """Return a calibrated robot: a sound one, one of three configurations, one measured far from the plate."""
    twin, data = campaign("irb120", 40, NOISE, 8)
    words = ["--train", "3"] if name == "three" else []
    if name == "far":
        rng = np.random.default_rng(8)
        middle = np.array([-140.0, -60.0, -60.0, -100.0, -80.0, 300.0])
        data = measure(twin, np.radians(middle + rng.uniform(-1.0, 1.0, (40, 6))), NOISE, rng)
    told(
        "calibrate", "irb120", written(folder, data, f"{name}.csv"), *words, "--out", folder / name, "--model=geometric"
    )
    return folder / name / "calibrated.yaml"


def compensated(arm: Path, folder: Path, *words: str) -> Told:
    return told("compensate", arm, folder / "plate.mod", "--out", folder / f"out-{arm.parent.name}", *ANSWERS, *words)


def test_a_sound_calibration_is_used_without_a_word(folder: Path) -> None:
    found = compensated(robot("sound", folder), folder)
    assert found.code == 0
    assert not {"rank-loss", "narrow-data", "not-better-here", "unproven", "edited-by-hand"} & found.levels.keys()


def test_a_calibration_that_lost_rank_is_refused_until_accepted(folder: Path) -> None:
    arm = robot("three", folder)
    refused = compensated(arm, folder)
    assert refused.code == 2
    assert "rank-loss" in refused.refusal
    assert "--accept rank-loss" in refused.refusal
    assert not (folder / "out-three").exists()
    names = set(re.findall(r"--accept ([a-z-]+)", refused.refusal))
    accepted = compensated(arm, folder, *(word for name in names for word in ("--accept", name)))
    assert accepted.code == 0, accepted
    assert accepted.says("rank-loss", "warning", "do not determine")


def test_a_calibration_measured_far_from_the_program_does_not_make_it_worse(folder: Path) -> None:
    arm = robot("far", folder)
    found = compensated(arm, folder)
    assert found.says("narrow-data", "warning", "expected"), found
    assert found.says("not-better-here", "warning", "plate.mod line 9"), found


@pytest.mark.parametrize("command", ["ik", "export"])
def test_what_else_uses_it_tells(command: str, folder: Path) -> None:
    poses = folder / "poses.csv"
    poses.write_text("pose,x [mm],y [mm],z [mm],qw,qx,qy,qz\na,400,100,400,0,0,1,0\n")
    for name, says in (("three", True), ("sound", False)):
        arm = robot(name, folder)
        words = {
            "ik": ["ik", arm, poses, "--out", folder / f"{name}-joints.csv"],
            "export": ["export", arm, "--format", "json", "--out", folder / f"{name}.json"],
        }
        found = told(*words[command])
        assert ("rank-loss" in found.levels) is says, found


def test_values_edited_by_hand(folder: Path, tmp_path: Path) -> None:
    text = robot("sound", folder).read_text()
    edited = tmp_path / "edited.yaml"
    number = re.search(r"d_1: \{?.*?value: (-?[\d.]+)", text, re.S)
    assert number is not None
    edited.write_text(text[: number.start(1)] + f"{float(number[1]) + 1.0:.6f}" + text[number.end(1) :])
    assert compensated(edited, folder).says("edited-by-hand", "warning", "changed after its calibration")
    edited.write_text(text.replace("title:", "# a remark\ntitle:"))
    assert "edited-by-hand" not in compensated(edited, folder).levels


def test_a_program_is_not_corrected_twice(folder: Path) -> None:
    arm = robot("sound", folder)
    compensated(arm, folder)
    twice = told("compensate", arm, folder / "out-sound" / "plate.mod", "--out", folder / "twice")
    assert twice.code == 2
    assert "corrected already" in twice.refusal


def test_a_robot_that_an_output_would_replace(folder: Path, tmp_path: Path) -> None:
    place = tmp_path / "compensation.html"
    place.write_bytes(robot("sound", folder).read_bytes())
    refused = told("compensate", place, folder / "plate.mod", "--out", tmp_path)
    assert refused.code == 2
    assert place.read_bytes() == robot("sound", folder).read_bytes()
