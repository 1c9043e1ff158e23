"""Plain matrices: rows of zeros and NaN are missing readings here, and nowhere else."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from truearm.engine.base.errors import InputError
from truearm.engine.data.readers.canonical import csv_text, read_csv
from truearm.importing.files import read_matrices

JOINTS = "# made by hand\n10 20\n\n0\t0  # home\n-1.5e1 3\n"
GOOD = "1 2 3\n0 0 0.0\n4 5 6\n"


def write(folder: Path, name: str, content: str) -> Path:
    path = folder / name
    path.write_text(content, encoding="utf-8")
    return path


def test_reads_row_by_row_and_counts_what_is_missing(tmp_path: Path) -> None:
    data, missing = read_matrices(
        write(tmp_path, "q.txt", JOINTS),
        {"a": write(tmp_path, "a.txt", GOOD), "b": write(tmp_path, "b.txt", "nan NaN NAN\n0 0 0\n1 0 0\n")},
        {"base": write(tmp_path, "base.txt", "NaN 1 2\n7 8 9\n7 8 9\n")},
        "deg",
        "mm",
    )
    assert missing == {"a": 1, "b": 2, "base": 1}
    assert data.labels == ("1", "2", "3")
    assert data.targets == ("a", "b")
    assert data.joint_kinds == ("revolute", "revolute")
    assert data.joints.tolist() == [[math.radians(v) for v in row] for row in ([10, 20], [0, 0], [-15, 3])]
    assert data.configuration.tolist() == [0, 0, 1, 1, 2, 2]
    assert data.target.tolist() == [0, 1, 0, 1, 0, 1]
    assert data.has_position.tolist() == [True, False, False, False, True, True]
    assert data.position[0].tolist() == [0.001, 0.002, 0.003]
    assert np.isnan(data.position[1]).all()
    assert data.references is not None
    assert data.references.targets == ("base",)
    assert data.references.has_position.tolist() == [False, True, True]


def test_units_are_taken_as_given(tmp_path: Path) -> None:
    files = write(tmp_path, "q.txt", "1 2"), {"a": write(tmp_path, "a.txt", "1 2 3")}
    data, _ = read_matrices(*files, {}, "rad", "m")
    assert data.joints.tolist() == [[1, 2]]
    assert data.position.tolist() == [[1, 2, 3]]
    assert data.references is None


@pytest.mark.parametrize(
    ("joints", "target", "parts"),
    [
        (JOINTS, "1 2 3\n", ["a.txt", "as many rows as", "1 row'", "allowed: 3 rows", "zeros or NaN"]),
        (JOINTS, "1 2 3\n1 2\n1 2 3", ["a.txt, line 2", "three numbers", "2 numbers", "allowed: 3 numbers"]),
        (JOINTS, "1 2 3\n1 2 inf\n1 2 3", ["a.txt, line 2, column 3", "'inf'", "NaN for a missing"]),
        (JOINTS, "x y z\n1 2 3", ["a.txt, line 1, column 1", "a number belongs here", "'x'", "heading with #"]),
        (JOINTS, "1,2,3\n", ["a.txt, line 1, column 1", "'1,2,3'", "Separate numbers by blanks", "import table"]),
        (JOINTS, "1;2;3\n", ["'1;2;3'", "import table"]),
        (JOINTS, "1_0 2 3\n", ["'1_0'"]),
        (JOINTS, "1 2e9 3\n", ["a.txt, line 1, column 2", "too large to be plausible", "'2e9'", "1e+09 mm"]),
        ("1 2\n1 1e8\n1 2", GOOD, ["q.txt, line 2, column 2", "too large", "5.72958e+07 deg"]),
        (JOINTS, "", ["a.txt: the file is empty"]),
        (JOINTS, "# nothing\n", ["a.txt: the file holds no rows", "exported whole"]),
        ("1 2\n1 NaN\n1 2", GOOD, ["q.txt, line 2, column 2", "'NaN'", "a finite number", "needs all joints"]),
        ("# q\n1 2\n1 2 3\n1 2", GOOD, ["q.txt, line 3", "not as long as line 2", "allowed: 2 numbers"]),
    ],
)
def test_refusals(tmp_path: Path, joints: str, target: str, parts: list[str]) -> None:
    files = write(tmp_path, "q.txt", joints), {"a": write(tmp_path, "a.txt", target)}
    with pytest.raises(InputError) as caught:
        read_matrices(*files, {}, "deg", "mm")
    for part in parts:
        assert part in str(caught.value)


def test_names_are_checked(tmp_path: Path) -> None:
    joints, target = write(tmp_path, "q.txt", JOINTS), write(tmp_path, "a.txt", GOOD)
    with pytest.raises(InputError, match=r"targets: no target is given"):
        read_matrices(joints, {}, {"a": target}, "deg", "mm")
    with pytest.raises(InputError, match=r"'a' is given as a target and as a reference.*different names"):
        read_matrices(joints, {"a": target}, {"a": target}, "deg", "mm")
    for name in ("", " a", "a\nb", "a\tb"):
        with pytest.raises(InputError, match=r"a point needs a name.*without blanks"):
            read_matrices(joints, {name: target}, {}, "deg", "mm")


@pytest.mark.parametrize("joints", ["joints_commanded.txt", "joints_read.txt"])
def test_laser_tracker_campaign(measured_data: Path, tmp_path: Path, joints: str) -> None:
    folder = measured_data / "irb120-faro"

    def files(*names: str) -> dict[str, Path]:
        return {name: folder / f"{name}.txt" for name in names}

    data, missing = read_matrices(
        folder / joints, files("target_1", "target_2", "target_3"), files("base_1", "base_2", "base_3"), "deg", "mm"
    )
    assert (data.configurations, data.joints.shape, data.targets) == (
        500,
        (500, 6),
        ("target_1", "target_2", "target_3"),
    )
    assert missing == {"target_1": 0, "target_2": 0, "target_3": 0, "base_1": 0, "base_2": 1, "base_3": 8}
    assert data.has_position.all()
    assert data.references is not None
    assert int((~data.references.has_position).sum()) == 9
    # The reflectors sit on one rigid tool: their distances repeat to some hundredths of a millimetre.
    first, second = (data.position[data.target == t] for t in (0, 1))
    assert np.linalg.norm(first - second, axis=1).std() < 2e-5

    text = csv_text(data)
    path = write(tmp_path, "irb120.csv", text)
    read = read_csv(path)
    assert csv_text(read) == text
    assert (read.labels, read.targets) == (data.labels, data.targets)
    np.testing.assert_allclose(read.joints, data.joints, rtol=1e-15)
    np.testing.assert_allclose(read.position, data.position, rtol=1e-15)
    assert read.references is not None
    assert read.references.targets == data.references.targets
