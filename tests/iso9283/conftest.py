from __future__ import annotations

from pathlib import Path

import pytest
from tests.house.examples import performance_files
from tests.iso9283.campaign_files import CUBE, Arguments, arguments_in


@pytest.fixture
def small(tmp_path: Path) -> Arguments:
    """The arguments of a small campaign that a test may change."""
    return arguments_in(tmp_path, performance_files())


@pytest.fixture(scope="session")
def cube(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file of a cube of 200 mm."""
    file = tmp_path_factory.mktemp("cube") / "cube.yaml"
    file.write_text(CUBE)
    return file
