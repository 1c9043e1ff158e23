"""What the plan in a project's folder was made with, as its manifest says, and what of that is not so now."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

from truearm.engine.base.errors import InputError
from truearm.engine.base.files import exists, read_bytes
from truearm.engine.base.manifest import hash_of, sets_in
from truearm.planning.planned import plan_inputs
from truearm.studio import words
from truearm.studio.plan_fields import UNSAID
from truearm.studio.planned import asked_by, cell_places
from truearm.studio.project import Project

#: Parameters that name files: these are compared by what they hold.
_FILES: Final = ("robot", "candidates_from", "constraints", "accurate_at", "tools", "frames")
_NUMBER: Final = re.compile(r"\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")


def other_plan_told(project: Project, table: str) -> str:
    """Return what to know of a plan that is not as it would be made now; nothing if there is none, or it is so.

    Args:
        table: The file of the plan, in the project.
    """
    path = project.path(table)
    if not exists(path):
        return ""
    try:
        file_set = next((one for one in sets_in(path.parent) if path.name in one.files), None)
        if file_set is None:
            return f"What the plan in {table} was made with is not known: no record of it stands beside it."
        if file_set.files[path.name] != hash_of(read_bytes(path)):
            return f"{table} was changed after it was written: its record tells of another plan."
        then = asked_by(file_set.command or "")
        if then is None:
            return f"What the plan in {table} was made with is not compared: it was written by {file_set.command}."
        now = _asked(project)
        return _told(table, then, file_set.inputs, now, _inputs(project, now))
    except InputError as error:
        return f"What the plan in {table} was made with cannot be compared: {words.refusal(error)}"


def _asked(project: Project) -> dict[str, str]:
    """Return what the page asks for now, by the names of parameters."""
    settings, fields = project.settings, project.settings.plan
    said = fields.said(cell_places(project.folder, fields, settings.cell), settings.constraints, settings.payload)
    asked = {"robot": settings.robot, "poses": fields.poses, **said}
    return {name: str(value) for name, value in asked.items()}


def _inputs(project: Project, asked: Mapping[str, str]) -> dict[str, str]:
    """Return the hashes of the files that are given to the plan now."""
    files = {name: project.path(asked[name]) if name in asked else None for name in _FILES[1:]}
    return plan_inputs(project.robot_source(), **files)


def _told(
    table: str, then: Mapping[str, str], read: Mapping[str, str], now: Mapping[str, str], reads: Mapping[str, str]
) -> str:
    """Return what differs, in words.

    Args:
        then, read: What the plan was asked for, and the hashes of the files that it read.
        now, reads: The same as it would be made now.
    """
    then, now = _whole(then), _whole(now)
    if "candidates_from" in then and "candidates_from" in now:  # none are drawn, however many were said
        now["candidates"] = then["candidates"]
    other: list[str] = []
    changed: list[str] = []
    unknown: list[str] = []
    for name in dict.fromkeys([*then, *now]):
        was, said = then.get(name), now.get(name)
        if name in _FILES and was is not None and said is not None:
            before, after = read.get(name), reads.get(name)
            if before is None and after is None:  # both of the library
                other += [name] if was != said else []
            elif before != after and was == said:
                (unknown if before is None else changed).append(f"{name} {said}")
            elif before != after or was.partition("#")[2] != said.partition("#")[2]:
                other.append(name)
        elif was is None or said is None or _plain(was) != _plain(said):
            other += [name] if was != said else []
    told = []
    if other:
        made, chosen = ("; ".join(_shown(name, of.get(name)) for name in other) for of in (then, now))
        told.append(f"The plan in {table} was made with {made}. Chosen now: {chosen}.")
    if changed:
        told.append(f"Files are not as they were when the plan in {table} was made: {', '.join(changed)}.")
    if unknown:
        told.append(f"Whether files are as they were, the record of {table} does not say: {', '.join(unknown)}.")
    if told:
        told.append("Picture, files and scene are of the plan as it was made: plan again to have it as chosen.")
    return " ".join(told)


def _whole(said: Mapping[str, str]) -> dict[str, str]:
    """Return what is asked for, with what the job takes where nothing is said."""
    return {**said, **{name: str(value) for name, value in UNSAID.items() if name not in said}}


def _shown(name: str, said: str | None) -> str:
    return f"{name} {'not said' if said is None else 'yes' if said == 'True' else said}"


def _plain(said: str) -> str:
    """Return a value as it is compared: 50.0 is 50, and spaces do not count."""
    return _NUMBER.sub(lambda one: f"{float(one[0]):.12g}", said.replace(" ", ""))
