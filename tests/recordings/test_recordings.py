"""The commands do what they did when they were recorded: exit codes, refusals, printed text and JSON, files."""

from __future__ import annotations

import platform
from itertools import islice

import pytest
from tests.recordings.comparing import differences
from tests.recordings.recording import GROUPS, Group, baseline_of, recorded

#: Differences that are shown of a group.
_SHOWN = 10


_CASES = [pytest.param(group, id=group.name, marks=() if group.quick else pytest.mark.slow) for group in GROUPS]


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="recorded on x86-64: last bits differ")
@pytest.mark.parametrize("group", _CASES)
def test_the_commands_do_what_they_did(group: Group) -> None:
    found = list(islice(differences(baseline_of(group), recorded(group), group.name), _SHOWN))
    assert not found, "\n".join(found)
