"""Plans that stand where another shall be written: what truearm wrote may be replaced, and that is told."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from truearm.errors import InputError
from truearm.files import exists
from truearm.jobs.arguments import file_for
from truearm.manifest import hash_of, sets_in
from truearm.notices import Notice


def plan_files_for(names: Collection[str], out: Path, *read: object) -> None:
    """Refuse places of files beside each other that cannot be, that others wrote or changed, or of another result.

    Args:
        names: Of all files that a plan of this kind has.
        out: One of them: the others stand beside it.
        read: What the job was given: none of these, as far as they are files, may be overwritten.
    """
    for name in names:
        file_for(out.with_name(name), *read, ours=True)
    for one in sets_in(out.parent):
        others = [name for name in one.files if name not in names]
        if others and any(name in one.files for name in names):
            raise InputError(
                "files of these names belong to another result there",
                parameter="out",
                where=str(out),
                came=f"written together with {others[0]}",
                cure="Choose another name.",
            )


def refuse_ways_of_another(ways: Path) -> None:
    """Refuse a place where the ways of another plan would stay beside one that has none."""
    if exists(ways):
        raise InputError(
            "the ways of another plan are there, and would stay beside this one, which has none",
            parameter="out",
            where=str(ways),
            cure="Choose another name, or remove that plan with its ways.",
        )


def replaced_notices(folder: Path, name: str, text: str) -> tuple[Notice, ...]:
    """Return what to know of a plan that truearm wrote earlier, nobody changed, and another is written over.

    Args:
        folder: In which it stands.
        name: Of the file that holds the plan itself.
        text: What that file will hold.
    """
    for one in sets_in(folder):
        if name in one.files and exists(folder / name) and one.files[name] != hash_of(text.encode()):
            again = f", written by '{one.command}'" if one.command else ""
            return (
                Notice(
                    "plan-replaced",
                    f"Another plan stood in {folder / name}{again}, and was replaced. What was measured or programmed "
                    "by that plan does not belong to this one. To keep both, write them to different places.",
                ),
            )
    return ()
