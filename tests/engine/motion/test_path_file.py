"""Path files: what they describe, and what they cannot be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tests.house.examples import PATH

from truearm.engine.base.errors import InputError
from truearm.engine.motion.path_file import PlannedPath, read_path

HEAD = """\
truearm: truearm-path/1
units: {length: mm, angle: deg, time: s}
speed: 100
acceleration: 500
step: 0.05
start: [300, 0, 300]
sections:
"""


def read(folder: Path, sections: str, head: str = HEAD) -> PlannedPath:
    file = folder / "path.yaml"
    file.write_text(head + sections)
    return read_path(file)


def refused(folder: Path, sections: str, head: str = HEAD) -> str:
    with pytest.raises(InputError) as refusal:
        read(folder, sections, head)
    return str(refusal.value)


def test_sections_follow_each_other_from_rest_to_rest(tmp_path: Path) -> None:
    file = tmp_path / "path.yaml"
    file.write_text(PATH)
    path = read_path(file)
    trajectory = path.trajectory
    assert path.kinds == ("line", "circle", "hermite")
    assert path.tip == pytest.approx((0.0, 0.0, 0.1))
    assert path.orientation == "full"
    assert path.rotation == pytest.approx(np.diag([1.0, -1.0, -1.0]))
    assert (np.diff(trajectory.time) > 0).all()
    ends = [int(np.flatnonzero(path.section == number)[-1]) for number in (1, 2, 3)]
    assert trajectory.position[ends] == pytest.approx(
        np.array([[0.35, 0.06, 0.25], [0.35, 0.06, 0.25], [0.35, 0.0, 0.25]]), abs=1e-12
    )
    assert trajectory.velocity[[0, *ends]] == pytest.approx(0.0, abs=1e-9)
    circle = trajectory.position[path.section == 2] - [0.35, 0.08, 0.25]
    assert np.linalg.norm(circle, axis=1) == pytest.approx(0.02, abs=1e-12)
    speeds = np.linalg.norm(trajectory.velocity, axis=1)
    assert speeds[path.section == 1].max() <= 0.2 + 1e-9
    assert speeds[path.section == 2].max() <= 0.1 + 1e-9
    step = np.diff(trajectory.position, axis=0) / np.diff(trajectory.time)[:, None]
    assert np.linalg.norm(step, axis=1).max() <= 0.2 + 1e-6


def test_units_are_those_of_the_file(tmp_path: Path) -> None:
    metres = HEAD.replace("length: mm", "length: m").replace("[300, 0, 300]", "[0.3, 0, 0.3]")
    metres = metres.replace("speed: 100", "speed: 0.1").replace("acceleration: 500", "acceleration: 0.5")
    one = read(tmp_path, "  - line: [300, 100, 300]\n")
    other = read(tmp_path, "  - line: [0.3, 0.1, 0.3]\n", metres)
    assert other.trajectory.position == pytest.approx(one.trajectory.position, abs=1e-12)


def test_an_axis_to_keep_is_a_rotation_about_it(tmp_path: Path) -> None:
    path = read(
        tmp_path, "  - line: [300, 100, 300]\n", HEAD.replace("speed:", "orientation: {axis: [0, 3, -4]}\nspeed:", 1)
    )
    assert path.orientation == "axis"
    assert path.rotation[:, 2] == pytest.approx([0.0, 0.6, -0.8])
    assert path.rotation @ path.rotation.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(path.rotation) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("sections", "said"),
    [
        ("  - line: [300, 0, 300]\n", r"sections\[1\]: the line has no length"),
        ("  - line: [300, 50, 300]\n  - hermite: [[300, 50, 300], [300, 0, 300]]\n", r"\[2\]: a waypoint repeats"),
        ("  - circle: [[300, 50, 300], [300, 100, 300]]\n", "three points on a line define no circle"),
        ("  - circle: {centre: [300, 0, 300], normal: [0, 0, 1]}\n", "radius and normal of a circle must not be zero"),
        ("  - circle: {centre: [300, 50, 300], normal: [0, 1, 0]}\n", "does not lie in its plane"),
        ("  - circle: {centre: [300, 50, 300], normal: [0, 0, 0]}\n", "a direction cannot be zero"),
        ("  - {line: [300, 50, 300], speed: -10}\n", "speed"),
        ("  - {line: [300, 50, 300], acceleration: 0}\n", "acceleration"),
        ("  - {line: [300, 50, 300], circle: [[1, 2, 3], [4, 5, 6]]}\n", "a section is of one kind"),
        ("  - {speed: 10}\n", "a section is of one kind"),
        ("  - {hermite: [[300, 50, 300]], times: [0, 1]}\n", "velocities and times belong together"),
        (
            "  - {hermite: [[300, 50, 300]], times: [0, -1], velocities: [[0, 0, 0], [0, 0, 0]]}\n",
            r"times.*0 or more|greater than or equal",
        ),
        (
            "  - {hermite: [[300, 50, 300]], times: [1, 0.5], velocities: [[0, 0, 0], [0, 0, 0]]}\n",
            "times do not rise",
        ),
        (
            "  - {hermite: [[300, 50, 300]], times: [0, 1], velocities: [[0, 9, 0], [0, 0, 0]]}\n",
            "a section begins and ends at rest",
        ),
        ("  - {hermite: [[300, 50, 300]], times: [0, 1], velocities: [[0, 0, 0]]}\n", "those of all waypoints"),
        (
            "  - {hermite: [[300, 50, 300]], times: [0, 1], velocities: [[0, 0, 0], [0, 0, 0]], speed: 5}\n",
            "has no other time law",
        ),
        ("  - {line: [300, 50, 300], speed: 1.0e-4}\n", "the path has too many samples"),
        ("  - {line: [300, 50]}\n", r"sections\[1\]"),
        ("  - {arc: [300, 50, 300]}\n", "arc"),
        ("  []\n", "sections"),
    ],
)
def test_what_a_section_cannot_be_is_refused_with_its_number(tmp_path: Path, sections: str, said: str) -> None:
    import re

    message = refused(tmp_path, sections)
    assert re.search(said, message), message
    assert "path.yaml" in message


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("units: {length: mm, angle: deg, time: s}\n", "", "units"),
        ("length: mm, ", "", "length"),
        ("time: s", "time: ms", "time"),
        ("step: 0.05", "step: -0.05", "step"),
        ("start: [300, 0, 300]\n", "", "start"),
        ("speed:", "tip: [0, 0, 1]\ntarget: a\nspeed:", "only one of them can follow the path"),
        ("speed:", "orientation: {axis: [0, 0, 0]}\nspeed:", "a direction cannot be zero"),
        ("speed:", "orientation: {}\nspeed:", "one orientation belongs here"),
        ("speed:", "orientation: {quaternion: [1, 1, 0, 0]}\nspeed:", "length 1"),
        ("speed:", "frame: tool\nspeed:", "frame"),
        ("speed: 100", "speed: 100\njoint_speeds: [10, 0]", "joint_speeds"),
    ],
)
def test_what_a_file_cannot_be_is_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in HEAD
    message = refused(tmp_path, "  - line: [300, 100, 300]\n", HEAD.replace(old, new, 1))
    assert said in message, message
    assert "path.yaml" in message


def test_how_long_a_direction_is_does_not_matter(tmp_path: Path) -> None:
    one = read(tmp_path, "  - circle: {centre: [300, 50, 300], normal: [0, 0, 1]}\n")
    other = read(tmp_path, "  - circle: {centre: [300, 50, 300], normal: [0, 0, 1.0e+300]}\n")
    assert other.trajectory.position == pytest.approx(one.trajectory.position, abs=1e-15)
