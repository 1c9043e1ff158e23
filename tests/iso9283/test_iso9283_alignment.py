"""Files of how the instrument was tied to the robot's base."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from truearm.engine.base.errors import InputError
from truearm.engine.motion.cube import Cube
from truearm.iso9283.criteria.alignment import best_fit, read_alignment, refuse_implausible

FILE = {
    "truearm": "truearm-alignment/1",
    "units": "{length: mm, angle: deg}",
    "kind": "base-features",
    "position": "[1500, -310, 12]",
    "quaternion": "[0, 0, 0, 1]",
    "sigma": "0.03",
    "sigma_rot": "0.002",
}


def written(folder: Path, **changes: str) -> Path:
    path = folder / "tie.yaml"
    path.write_text("".join(f"{key}: {value}\n" for key, value in (FILE | changes).items()), encoding="utf-8")
    return path


def test_a_tie_is_read(tmp_path: Path) -> None:
    tie = read_alignment(written(tmp_path))
    assert tie.in_base(np.array([[1.0, 0, 0]])) == pytest.approx(np.array([[0.5, -0.31, 0.012]]))
    assert tie.kind == "base-features"
    assert (tie.sigma, tie.sigma_rot) == pytest.approx((3e-5, math.radians(0.002)))
    line = np.arange(5.0)[:, None] * np.ones(3)
    with pytest.raises(InputError, match="do not lie on a line"):
        best_fit(line, line)


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        ("quaternion", "[1, 1, 0, 0]", "does not have length 1"),
        ("sigma", "0", "too small"),
        ("sigma_rot", "-1", "too small"),
        ("kind", "best-fit", "kind"),
        ("units", "{length: in, angle: deg}", "length"),
        ("position", "[1, 2]", "position"),
    ],
)
def test_a_tie_that_cannot_be_used_is_refused(tmp_path: Path, key: str, value: str, text: str) -> None:
    with pytest.raises(InputError, match=text) as refused:
        read_alignment(written(tmp_path, **{key: value}))
    assert "tie.yaml" in str(refused.value)


#: A quarter of a turn about z, and then moved: what lies in the cube, in the base frame.
CUBE = Cube([0.4, 0.1, 0.5], 0.25)
TURNED = {"quaternion": "[0.7071067812, 0, 0, 0.7071067812]"}


def measured_in(folder: Path) -> np.ndarray:
    """Return points of the cube in the instrument's frame of a sound file."""
    tie = read_alignment(written(folder, **TURNED))
    R, p = tie.T_base_instrument.rotation, np.array(tie.T_base_instrument.translation)
    return np.asarray((CUBE.plane("C1-C2-C7-C8").measuring_points - p) @ R)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"position": "[1.5, -0.31, 0.012]"}, "Is the position in m where the file says mm?"),
        ({"units": "{length: m, angle: deg}", "sigma": "3e-5"}, "Is the position in mm where the file says m?"),
        ({"position": "[310, 1500, -12]", "quaternion": "[0.7071067812, 0, 0, -0.7071067812]"}, "the base in the inst"),
        ({"quaternion": "[0, 0, 0.7071067812, 0.7071067812]"}, "Does the quaternion begin with x?"),
        ({"position": "[-4000, 0, 0]"}, "Check its numbers and units"),
    ],
)
def test_a_tie_that_puts_the_readings_elsewhere_is_refused_with_its_likely_cause(
    changes: dict[str, str], words: str, tmp_path: Path
) -> None:
    measured = measured_in(tmp_path)
    refuse_implausible(read_alignment(written(tmp_path, **TURNED)), CUBE, measured, "tie.yaml")
    tie = read_alignment(written(tmp_path, **(TURNED | changes)))
    with pytest.raises(InputError, match="lies far from the cube of the tests") as refusal:
        refuse_implausible(tie, CUBE, measured, "tie.yaml")
    assert words in str(refusal.value)
    assert str(refusal.value).startswith("tie.yaml: ")
