"""Every feature can be deleted: the rest is imported, is typed, lists what is left, and passes its tests."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.house.pruning import Gone, Pruned, prune
from tests.house.removal import faults, features, removed
from tests.mutants.running import copy_of_the_tree
from tests.mutants.tree import ROOT

from truearm import JOBS


@pytest.mark.slow
@pytest.mark.parametrize("feature", features())
def test_a_feature_can_be_deleted(feature: str, tmp_path: Path) -> None:
    copy = copy_of_the_tree(tmp_path)
    gone = removed(copy, feature)
    assert not (copy / "src" / "truearm" / feature).exists()
    assert faults(copy, gone, whole=False) == {}


HELPER = """\
from truearm.gears.gear import turn
from truearm.wheels.wheel import roll
FRICTION = {"turn": lambda: turn(1), "roll": lambda: roll(2)}  # both
def turned() -> int:
    return turn(3)
"""
TEST = """\
import pytest
import truearm
from tests.commanding import Truearm
from tests.helper import FRICTION, turned
SLOW = ("turn", "roll")
CASES = (Case("turn", 1), Case("roll", 2))
COMMAND = ["python", "-m", "truearm"]
FILES = {"a": Case({"x": "turn"}), "b": Case({"x": "roll"})}
@pytest.fixture
def geared():
    return turned()
@pytest.mark.parametrize("job", ["turn", "roll"])
def test_of_both(job):
    assert FRICTION[job]  # of each
@pytest.mark.parametrize("job", ["turn"])
def test_of_one(job):
    assert FRICTION[job]
def test_with_a_fixture(geared): pass
def test_by_the_package(): truearm.turn(1)
def test_by_a_command(truearm): truearm("gears", "turn", "x")
def test_by_words(truearm):
    for words in (["show", 1], ["gears", "turn"]):
        truearm(*words)
def test_by_words_put_after_others(): run([*COMMAND, "gears", "turn"])
def test_by_a_key(): FRICTION["turn"](1)
def test_in_a_text(): run("from truearm import turn")
def test_inside():
    from truearm.gears import gear
def test_of_another():
    turned = gears = 3
    truearm.roll(turned)
    print(gears, turned)
"""


def test_what_uses_a_deleted_module_goes_and_nothing_else() -> None:
    gone = Gone({"truearm.gears"}, {("truearm", "turn")}, {"turn"}, {"roll"}, {("gears",)})
    test = Pruned(Path("tests/house/test_gears.py"), TEST, registry=True)
    helper = Pruned(Path("tests/helper.py"), HELPER, registry=True)
    prune([test, helper], gone)
    assert helper.written() == ("from truearm.wheels.wheel import roll\nFRICTION = {'roll': lambda: roll(2)}\n")
    assert test.written() == (
        "import pytest\nimport truearm\nfrom tests.commanding import Truearm\n"
        "from tests.helper import FRICTION\nSLOW = ('roll',)\nCASES = (Case('roll', 2),)\n"
        'COMMAND = ["python", "-m", "truearm"]\n'
        "FILES = {'b': Case({'x': 'roll'})}\n"
        "@pytest.mark.parametrize('job', ['roll'])\ndef test_of_both(job):\n    assert FRICTION[job]  # of each\n"
        "def test_of_another():\n    turned = gears = 3\n    truearm.roll(turned)\n    print(gears, turned)\n"
    )
    went = (
        "of_one",
        "with_a_fixture",
        "by_the_package",
        "by_a_command",
        "by_words",
        "by_a_key",
        "in_a_text",
        "inside",
        "by_words_put_after_others",
    )
    assert sorted(gone.tests) == sorted(f"tests/house/test_gears.py::test_{name}" for name in went)


def test_the_engine_names_no_feature_and_no_job() -> None:
    """What names one, be it in a docstring, could not stay where that is deleted."""
    jobs = {("truearm", name) for name, home in JOBS.items() if not home.startswith("truearm.engine.")}
    everything = Gone({f"truearm.{name}" for name in features()} | {"papers"}, jobs)
    of_engine = (ROOT / "src" / "truearm" / "engine").rglob("*.py")
    files = (Pruned(path.relative_to(ROOT), path.read_text("utf-8"), registry=False) for path in of_engine)
    assert [file.module for file in files if file.touched(everything)] == []
