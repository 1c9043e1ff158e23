"""The commands do what they did when they were recorded: exit codes, refusals, printed text and JSON, files."""

from __future__ import annotations

import platform
import re
from itertools import islice
from pathlib import Path

import pytest
from tests.recordings.comparing import differences, same_robot
from tests.recordings.recording import GROUPS, Group, baseline_of, recorded

#: Differences that are shown of a group.
_SHOWN = 10


_CASES = [pytest.param(group, id=group.name, marks=() if group.quick else pytest.mark.slow) for group in GROUPS]


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="recorded on x86-64: last bits differ")
@pytest.mark.parametrize("group", _CASES)
def test_the_commands_do_what_they_did(group: Group) -> None:
    found = list(islice(differences(baseline_of(group), recorded(group), group.name), _SHOWN))
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ({"a": [1.0, 2]}, {"a": [1.0 + 9e-10, 2]}, None),
        ({"a": [1.0, 2]}, {"a": [1.0 + 3e-9, 2]}, " > a[1]: 1.0 -> 1.000000003"),
        ({"a": 0.0}, {"a": 2e-12}, " > a: 0.0 -> 2e-12"),
        ({"a": None}, {}, " > a: None -> ('missing',)"),
        ({"a": 1}, {"a": True}, " > a: 1 -> True"),
        ({"exit": 2}, {"exit": 0}, " > exit: 2 -> 0"),
        ("mean 0.123 mm", "mean 0.123000000001 mm", None),
        ("mean 0.123 mm", "mean 0.124 mm", ": 'mean 0.123 mm' -> 'mean 0.124 mm'"),
        ("mean 0.123 mm", "rms 0.123 mm", ": 'mean 0.123 mm' -> 'rms 0.123 mm'"),
        (["one", "two 2", "three"], ["one", "three"], "[2]: 'two 2' -> ('missing',)"),
        (["one", "two 2"], ["one", "half", "two 2.1"], "[2]: ('missing',) -> 'half'"),
    ],
)
def test_differences_are_told(old: object, new: object, told: str | None) -> None:
    assert next(differences(old, new), None) == told


def test_robot_files_are_the_same_where_redundant_values_lie_elsewhere() -> None:
    lines = (Path(__file__).parent / "written" / "calibrated" / "calibrated.yaml").read_text().splitlines()

    def moved(by: dict[str, float], of: list[str], what: str = "value") -> list[str]:
        """Return a robot file with other numbers of parameters [mm or deg]."""
        text = "\n".join(of)
        for name, step in by.items():
            pattern = rf"(?m)^(  {name}: .*\b{what}: )([^,}}]*)"
            found = re.search(pattern, text)
            assert found
            text = f"{text[: found.start(2)]}{float(found[2]) + step!r}{text[found.end(2) :]}"
        return text.split("\n")

    farther = moved({"d_6": 1e-4, **{f"target_{name}_z": -1e-4 for name in "123"}}, lines)
    assert same_robot(lines, farther)  # a longer last link, and targets nearer to its end
    assert not same_robot(lines, moved({"d_6": 1e-4}, lines))
    assert not same_robot(lines, moved({"theta_offset_2": 1e-6}, lines))
    assert not same_robot(lines, moved({"d_6": 1e-4}, farther, "deviation"))
