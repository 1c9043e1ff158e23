"""What was fixed when the measuring of a plan began: written down, and held against it when it goes on."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any, Final

from truearm.errors import InputError, refusals_of
from truearm.files import read_text
from truearm.measurement.measuring.about import About
from truearm.measurement.measuring.reading_log import LOG
from truearm.measurement.measuring.session import Session
from truearm.modeling.robot import Robot
from truearm.writing import write_text

#: What was fixed when the measuring began.
BEGUN: Final = "measuring.json"
_SCHEMA: Final = "truearm-measuring/1"


def begin(
    folder: Path,
    plan: list[Any],
    robot: Robot,
    session: Session,
    virtual: dict[str, Any] | None,
    about: About,
) -> None:
    """Write down what is fixed from now on, or refuse what is not as it was when the measuring began.

    Args:
        plan: What it holds, as JSON writes it.
        virtual: The virtual instrument and its twin; None for a real instrument.

    Raises:
        InputError: If the folder holds the measuring of another plan or robot, or one that began otherwise.
    """
    now: dict[str, Any] = {
        "truearm": _SCHEMA,
        "plan": hash_of(plan),
        "robot": f"{robot.name} {hash_of([[p.name, p.value] for p in robot.parameters.values()])}",
        "targets": [*session.targets],
        "nests": [*session.nests],
        "every": session.every,
        "quality": session.quality.__dict__,
        "source": virtual or "instrument",
        "about": about.fixed,
    }
    path = folder / BEGUN
    if not path.exists():
        if (folder / LOG).exists():
            raise InputError(
                "there are readings in this folder, and nothing says of which plan",
                parameter="out",
                where=str(folder / LOG),
                cure="Choose another folder.",
            )
        write_text(path, json.dumps(now, indent=2) + "\n")
        return
    with refusals_of("out"):
        then = _then(path)
    for name, value in now.items():
        was: Any = then.get(name)
        if name == "about":
            changed = [k for k, v in value.items() if v is not None and was.get(k) not in (None, v)]
            if not changed:
                continue
            value, was = value[changed[0]], f"{was[changed[0]]} ({changed[0]})"
        elif was == json.loads(json.dumps(value)):
            continue
        came, allowed = json.dumps(value), f"{was if name == 'about' else json.dumps(was)}"
        if name == "plan":  # a hash
            came, allowed = "the plan as it is now", "the plan as it was then"
        elif name == "robot":  # a name and a hash
            came, allowed = (str(said).rpartition(" ")[0] for said in (value, was))
            if came == allowed:
                came, allowed = f"{came} with other values", f"{allowed} as it was then"
        raise InputError(
            f"the measuring in this folder began with another {_CALLED.get(name, name)}",
            parameter="out",
            where=str(path),
            came=came,
            allowed=allowed,
            cure="Go on as it began, or measure into another folder.",
        )


_CALLED: Final = {"quality": "limit of what is kept", "source": "source of readings", "about": "instrument or robot"}


def _then(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(read_text(path))
    except ValueError:
        content = None
    if isinstance(content, dict) and content.get("truearm") == _SCHEMA and isinstance(content.get("about"), dict):
        return content
    raise InputError("this does not say how a measuring began", where=str(path), cure="Choose another folder.")


def hash_of(content: object) -> str:
    """Return by what contents that JSON can write are known again."""
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()
