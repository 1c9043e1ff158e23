"""The wheel works outside the clone, and importing stays cheap."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import truearm
from truearm.engine.command.request import SPACES

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def unpacked_wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)],
        cwd=ROOT,
        check=True,
        capture_output=True,
    )
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder / "site")
    return folder / "site"


def test_the_wheel_calibrates_outside_the_clone(unpacked_wheel: Path, tmp_path: Path) -> None:
    script = (
        f"import sys\nsys.path.insert(0, {str(unpacked_wheel)!r})\nimport truearm\nfrom truearm.commands import main\n"
        f"assert {str(unpacked_wheel)!r} in truearm.__file__\n"
        "for c in ('truearm robots', 'truearm demo --out demo', 'truearm new-robot a.yaml', 'truearm show a.yaml'):\n"
        "    sys.argv = c.split()\n"
        "    try:\n        main()\n    except SystemExit as end:\n        assert not end.code\n"
    )
    subprocess.run([sys.executable, "-c", script], cwd=tmp_path, check=True, capture_output=True)
    assert (tmp_path / "a.yaml").exists()
    assert (tmp_path / "demo" / "report.html").stat().st_size > 1_000_000


def test_an_installation_says_where_the_studies_are(unpacked_wheel: Path, tmp_path: Path) -> None:
    script = (
        f"import sys\nsys.path.insert(0, {str(unpacked_wheel)!r})\nfrom truearm.commands import main\n"
        "sys.argv = 'truearm study li-table --out found'.split()\nmain()\n"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 2
    assert "the published experiments are no part of an installation. Get the source of truearm" in done.stderr
    assert not (tmp_path / "found").exists()
    assert not list(unpacked_wheel.rglob("papers"))


def test_the_wheel_is_typed_and_licensed(unpacked_wheel: Path) -> None:
    assert (unpacked_wheel / "truearm" / "py.typed").exists()
    assert list(unpacked_wheel.glob("*.dist-info/licenses/LICENSE"))
    assert not list(unpacked_wheel.rglob("tests"))


def test_a_calibration_imports_neither_scipy_optimize_nor_plotly() -> None:
    script = (
        "import sys, truearm\nfrom truearm import calibrate\n"
        "print([m for m in ('scipy.optimize', 'plotly') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_job_of_a_group_has_a_short_name_in_its_namespace_and_unknown_names_are_refused() -> None:
    for name in truearm.JOBS:
        space, _, short = name.partition("_")
        if space in SPACES:
            assert getattr(getattr(truearm, SPACES[space]), short) is getattr(truearm, name)
    with pytest.raises(AttributeError, match="has no attribute 'calibrat'"):
        truearm.calibrat  # noqa: B018
