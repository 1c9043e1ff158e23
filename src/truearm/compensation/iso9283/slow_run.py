"""The record of the slow run: programs at the full velocity are written only after the slow ones were run to their end.

::

    truearm: truearm-slow-run/1
    plan: 5d2f...
    completed: no
    by: ''
    date: ''
    programs:
      programs/AP_10.mod: 8c1e...

The operator fills in ``completed: yes``, who ran the programs, and the day on which they did (2026-11-23). Plan and
programs are known by their hashes (SHA-256), so that a record is of this plan and these programs alone.
"""

from __future__ import annotations

import datetime
from collections.abc import Mapping
from pathlib import Path
from typing import Final, Literal

from pydantic import BaseModel

from truearm.errors import InputError, Words
from truearm.files import read_yaml
from truearm.manifest import hash_of
from truearm.modeling.formats.entries import STRICT

SLOW_RUN: Final = "slow-run.yaml"
_SCHEMA: Final = "truearm-slow-run/1"


class SlowRunFile(BaseModel):
    """Schema ``truearm-slow-run/1``."""

    model_config = STRICT
    truearm: Literal["truearm-slow-run/1"]
    plan: str
    completed: Literal["yes", "no"]
    by: str
    date: datetime.datetime | datetime.date | str
    programs: dict[str, str]


def slow_run_text(plan: str, programs: Mapping[str, str]) -> str:
    """Return the record of a slow run that is still to be done.

    Args:
        plan: Text of the plan file.
        programs: Texts of the slow programs, by their names.
    """
    lines = [
        "# Run every program below at its velocity from its first motion to its last, with nobody in reach of the",
        "# robot. Then say so here: completed: yes, by: who, date: the day, as 2026-11-23.",
        f"truearm: {_SCHEMA}",
        f"plan: {hash_of(plan.encode())}",
        "completed: no",
        "by: ''",
        "date: ''",
        "programs:",
        *(f"  {name}: {hash_of(text.encode())}" for name, text in programs.items()),
    ]
    return "\n".join(lines) + "\n"


def check_slow_run(path: Path, plan: str, programs: Mapping[str, str], today: datetime.date) -> None:
    """Refuse a record that is not of a completed slow run of a plan and its programs.

    Args:
        path: The record.
        plan, programs: As for :func:`slow_run_text`.
        today: A run of a later day is not done yet; a day more is allowed, as dates differ around the world.

    Raises:
        InputError: If it is of another plan or of other programs, not completed, does not say by whom and when, or
            names a day that is no date or still to come.
    """
    record = read_yaml(path, SlowRunFile)
    if record.plan != hash_of(plan.encode()):
        raise InputError(
            "the slow run was of another plan",
            where=f"{path}, plan",
            came=record.plan[:12],
            allowed=hash_of(plan.encode())[:12],
            cure="Run the slow programs of this plan.",
        )
    wanted = {name: hash_of(text.encode()) for name, text in programs.items()}
    if record.programs != wanted:
        other = next(name for name in {**wanted, **record.programs} if wanted.get(name) != record.programs.get(name))
        raise InputError(
            "the slow run was of other programs",
            where=f"{path}, programs",
            came=other,
            cure="Plan with the same language and dwell, or run the slow programs again.",
        )
    if record.completed != "yes":
        raise InputError(
            "the slow run is not completed, so no faster programs are written",
            where=f"{path}, completed",
            came=record.completed,
            allowed="yes",
            cure="Run every slow program to its end, and say so.",
        )
    for name, value in (("by", record.by), ("date", str(record.date))):
        if not value.strip():
            raise InputError(
                "the record does not say by whom and when the slow run was done",
                where=f"{path}, {name}",
                cure="Fill it in.",
            )
    day = _day(record.date, f"{path}, date")
    if day > today + datetime.timedelta(days=1):
        raise InputError(
            "the day of the slow run is still to come",
            where=f"{path}, date",
            came=Words(day.isoformat()),
            allowed=f"{today.isoformat()}, or earlier",
            cure="State the day on which the slow programs were run to their end.",
        )


def _day(date: datetime.datetime | datetime.date | str, where: str) -> datetime.date:
    """Return the day that a record names."""
    if isinstance(date, datetime.datetime):
        return date.date()
    if isinstance(date, datetime.date):
        return date
    try:
        return datetime.date.fromisoformat(date.strip())
    except ValueError:
        raise InputError(
            "the day of the slow run is no date",
            where=where,
            came=date,
            allowed="year-month-day, such as 2026-11-23",
            cure="State the day on which the slow programs were run to their end.",
        ) from None
