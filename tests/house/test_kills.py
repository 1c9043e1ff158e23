"""Every job that writes files, killed before every operation that changes one: ``python -m tests.kill_every_job``."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.kill_every_job import EARLIER, PLACES, tried

#: Faults that are known: the test says when they are corrected.
KNOWN = {"example": pytest.mark.xfail(reason="killed, it leaves files of names that are drawn, and refuses to go on")}


@pytest.mark.slow
@pytest.mark.parametrize("job", [pytest.param(job, marks=KNOWN.get(job, ())) for job in PLACES])
def test_what_a_kill_leaves_is_old_or_new_and_the_next_run_goes_on(job: str, tmp_path: Path) -> None:
    for earlier in (False, True) if job in EARLIER else (False,):
        folder = tmp_path / f"earlier-{earlier}"
        folder.mkdir()
        assert "kills" in tried(job, folder, earlier=earlier)
