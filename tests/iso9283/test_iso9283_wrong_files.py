"""Files of tests by ISO 9283 that are not what they should be, told in words that help."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from tests.house.examples import performance_files

import truearm
from truearm.engine.base.errors import InputError
from truearm.iso9283.planning.plan_file import read_cube

Arguments = dict[str, Any]


@pytest.fixture
def small(tmp_path: Path) -> Arguments:
    """Return the arguments of a small campaign that a test may change."""
    for name, text in performance_files().items():
        (tmp_path / name).write_text(text)
    names = ("poses", "paths", "settling", "forces")
    return {"plan": tmp_path / "plan.yaml", "alignment": tmp_path / "alignment.yaml"} | {
        name: tmp_path / f"{name}.csv" for name in names
    }


def refusal_of(given: Arguments) -> InputError:
    with pytest.raises(InputError) as refusal:
        truearm.iso9283_evaluate(**given)
    return refusal.value


@pytest.mark.parametrize("name", ["poses", "paths", "settling", "forces"])
def test_semicolons_are_named_with_what_to_do(small: Arguments, name: str) -> None:
    small[name].write_text(small[name].read_text().replace(",", ";"))
    found = refusal_of(small)
    assert found.parameter == name
    assert "not separated by commas; got 'semicolons'" in str(found)
    assert str(found).endswith("Save the file with commas and decimal points.")


@pytest.mark.parametrize("name", ["poses", "paths", "settling", "forces"])
def test_a_column_that_is_like_none_is_not_taken_for_another(small: Arguments, name: str) -> None:
    first, *rows = small[name].read_text().splitlines()
    small[name].write_text("\n".join([f"{first},note", *(f"{row},a" for row in rows)]) + "\n")
    found = refusal_of(small)
    assert found.came == "note"
    assert found.cure == "Rename it, or leave it out."
    small[name].write_text("\n".join([first.replace("cycle", "cycel"), *rows]) + "\n")
    assert refusal_of(small).cure == "Did you mean cycle?"


def test_a_pose_that_is_like_none_is_not_taken_for_another(small: Arguments) -> None:
    small["poses"].write_text(small["poses"].read_text().replace(",P1,", ",P9,", 1))
    found = refusal_of(small)
    assert found.came == "P9"
    assert "Did you mean" not in str(found)


def test_an_alignment_in_another_unit_is_named_and_no_path(small: Arguments) -> None:
    text = small["alignment"].read_text()
    numbers = re.search(r"position: \[(.*)\]", text)
    assert numbers is not None
    metres = ", ".join(str(float(number) / 1e3) for number in numbers[1].split(","))
    small["alignment"].write_text(text.replace(numbers[1], metres))
    found = refusal_of(small)
    assert found.parameter == "alignment"
    assert str(small["alignment"]) in str(found)
    assert "Is the position in m where the file says mm?" in str(found)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("not json", "got a text that is not JSON"),
        ('{"a": 1}', "got JSON of something else"),
        ('{"truearm": "truearm-calibration/1"}', "got a file of the kind truearm-calibration/1"),
        ("[]", "got JSON of something else"),
        ('{"truearm": "truearm-iso9283-result/1"}', "got a result without robot"),
    ],
)
def test_another_file_than_a_result_is_told_in_plain_words(
    small: Arguments, tmp_path: Path, text: str, said: str
) -> None:
    (tmp_path / "other.json").write_text(text)
    found = refusal_of({**small, "compare": tmp_path / "other.json"})
    assert found.parameter == "compare"
    assert said in str(found)
    assert "iso9283.json that" in str(found) or "iso9283.json of" in str(found)


@pytest.mark.parametrize(
    ("units", "side", "said"),
    [
        ("mm", "0.25", "got 0.25 mm; allowed: 10 mm to 20 m. Are these numbers in m?"),
        ("m", "250", "got 250 m; allowed: 10 mm to 20 m. Are these numbers in mm?"),
        ("mm", "30000", "Check the number and its unit."),
    ],
)
def test_a_cube_in_another_unit_is_told_by_its_side(tmp_path: Path, units: str, side: str, said: str) -> None:
    path = tmp_path / "cube.yaml"
    path.write_text(f"truearm: truearm-cube/1\nunits: {{length: {units}}}\ncentre: [1, 0, 1]\nside: {side}\n")
    with pytest.raises(InputError, match="no robot is tested in a cube of this side") as refusal:
        read_cube(path)
    assert said in str(refusal.value)
    assert f"{path}, side" in str(refusal.value)
