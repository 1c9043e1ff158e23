"""The robots of the library."""

from __future__ import annotations

from truearm.errors import InputError, nearest_names, wrong_kind
from truearm.jobs.arguments import whole_argument
from truearm.library import close_names, letters, library, load_robot
from truearm.modeling.robot import Robot
from truearm.results.library import RobotList


def robots(text: str | None = None, *, maker: str | None = None, axes: int | None = None) -> RobotList:
    """List the robots of the library: maker, joints, reach, and whether their controllers are known.

    Parameters
    ----------
    text
        Words that stand in the id or the full name; small letters, blanks, signs and accents are the same as others.
        None for all.
    maker
        Whose robots; None for all.
    axes
        How many joints they have; None for any number.

    Raises
    ------
    InputError
        If the library has no such robot.
    """
    found = [load_robot(robot_id) for robot_id in library()]
    if maker is not None:
        found = _of_maker(found, maker)
    if axes is not None:
        found = _with_axes(found, whole_argument(axes, "axes", 1))
    if text is not None:
        found = _named(found, text)
    return RobotList(tuple(found))


def _of_maker(robots: list[Robot], maker: object) -> list[Robot]:
    makers = sorted({robot.maker for robot in robots if robot.maker})
    if not isinstance(maker, str):
        raise wrong_kind("a maker belongs here", maker, "maker", ", ".join(makers))
    found = [robot for robot in robots if letters(maker) and _begins(robot.maker, maker)]
    if not found:
        near = nearest_names(maker, makers)
        raise InputError(
            "the library has no robot of this maker",
            parameter="maker",
            came=maker,
            allowed=", ".join(makers),
            cure=f"Did you mean {' or '.join(near)}?" if near else None,
        )
    return found


def _begins(maker: str, text: str) -> bool:
    """Return whether a maker's name, a word of it, or the initials of its words begin with a text."""
    words = [letters(word) for word in maker.split()]
    return any(name.startswith(letters(text)) for name in (letters(maker), *words, "".join(word[:1] for word in words)))


def _with_axes(robots: list[Robot], axes: int) -> list[Robot]:
    found = [robot for robot in robots if len(robot.joints) == axes]
    if not found:
        known = sorted({len(robot.joints) for robot in robots})
        raise InputError(
            "none of these robots has so many joints",
            parameter="axes",
            came=axes,
            allowed=", ".join(str(count) for count in known),
        )
    return found


def _named(robots: list[Robot], text: object) -> list[Robot]:
    if not isinstance(text, str):
        raise wrong_kind("a part of a name belongs here", text, "text", "words such as 'UR' or 'IRB 1200'")
    words = [letters(word) for word in text.split()]
    # Words by themselves, as of one maker and type, or together, as a type is written with blanks.
    found = [robot for robot in robots if all(words) and words and _holds(robot, words, letters(text))]
    if not found:
        near = [name for name in close_names(text) if any(robot.name == name for robot in robots)]
        raise InputError(
            "none of these robots is called so",
            parameter="text",
            came=text,
            cure=f"Did you mean {' or '.join(near)}?" if near else "Run 'truearm robots' for all.",
        )
    return found


def _holds(robot: Robot, words: list[str], together: str) -> bool:
    """Return whether id or full name hold words."""
    names = (letters(robot.name), letters(robot.title))
    return any(together in name or all(word in name for word in words) for name in names)
