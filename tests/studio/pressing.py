"""What a user does on a page, without a browser, and long actions that end at once."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from truearm.engine.base.errors import InputError
from truearm.studio.window import Window


def act(element: Any, value: Any = None) -> None:
    """Do with an element what a user does: give it a value, or press it."""
    if value is not None:
        element._impl.value = value
    for callback in element._impl.update_cb:
        callback(SimpleNamespace(client=object(), target=element))  # those of the studio itself have no client


def at_once(window: Window, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Let long actions run in this process and end before `start` returns; return the words of their progress."""
    said: list[str] = []

    def start(title: str, do: Any, done: Any, told: Any = lambda _: None, **arguments: Any) -> None:
        def progress(text: str) -> None:
            said.append(text)
            told(text)

        with monkeypatch.context() as there:
            there.chdir(Path.cwd())  # what it changes to is changed back
            try:
                found = do(**arguments, progress=progress)
            except InputError as error:
                window.refuse(error)
                return
        window.project.look(window.project.settings.result, window.project.settings.corrected)
        done(found)
        window.refresh()

    monkeypatch.setattr(window, "start", start)
    return said


def notices(window: Window) -> str:
    """Return all that the window says in its notices."""
    return "".join(window._told)


def below(window: Window, element: Any) -> str:
    """Return the refusal that a page shows right below an element; nothing if there is none."""
    container: Any = window.gui._container_handle_from_uuid[element._impl.parent_container_id]
    following = [one for one in container._children.values() if getattr(one, "order", -1.0) > element.order]
    first = min(following, key=lambda one: one.order, default=None)
    content = getattr(first, "content", "")
    return content if 'role="alert"' in content else ""
