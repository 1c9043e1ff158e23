"""Makes the tests' own helpers importable as ``tests.<room>.<helper>``, however pytest is started."""

import os
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))


@pytest.fixture(scope="session")
def measured_data() -> Path:
    """Folder of the real measurements, which are not part of the repository."""
    folder = Path(os.environ.get("TRUEARM_DATA") or Path(__file__).parents[1].parent / "shared" / "data")
    if not (folder / "irb120-faro").is_dir():
        pytest.skip(f"no measured data in {folder}; name their folder in TRUEARM_DATA")
    return folder
