"""Fields of a page that show a group of settings, and change it where somebody has typed or chosen; and their lists."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Final

from truearm.engine.base.errors import InputError
from truearm.engine.base.units import as_number
from truearm.studio.window import Window

#: What stands in a list where nothing is chosen: an empty text would stop the whole page.
NONE: Final = "(none)"


def offer(element: Any, names: Iterable[str], value: str | None, none: str | None = NONE) -> None:
    """Let a list offer names and show the chosen one, which is offered even where it is no longer there.

    Args:
        none: What stands for nothing chosen; None where something always is.
    """
    offered = dict.fromkeys([*([] if none is None else [none]), *names, *([] if value is None else [value])])
    if element.options != tuple(offered):
        element.options = tuple(offered)
    element.value = none if value is None else value


def chosen(element: Any, none: str = NONE) -> str | None:
    """Return what is chosen in a list; None if nothing is."""
    return None if element.value == none else str(element.value)


class Fields:
    """Fields, each of one setting by its name.

    Args:
        shown: Returns the settings as they are now.
        change: Changes one setting, by its name.
    """

    def __init__(
        self, window: Window, shown: Callable[[], Mapping[str, Any]], change: Callable[[str, Any], None]
    ) -> None:
        self._window, self._now, self._change = window, shown, change
        self._elements: dict[str, tuple[Any, Callable[[Any, Any], None]]] = {}

    def text(self, name: str, label: str, hint: str) -> None:
        """Add a field of a text; an empty one says nothing."""
        element = self._window.gui.add_text(label, "", hint=hint)
        element.on_update(self._window.settled(lambda: self._change(name, element.value.strip() or None)))
        self._elements[name] = (element, _show_text)

    def number(self, name: str, label: str, hint: str, *, optional: bool = True, whole: bool = False) -> None:
        """Add a field of a number; an empty one says nothing, if that may be."""
        element = self._window.gui.add_text(label, "", hint=hint)

        def typed() -> None:
            text = element.value.strip()
            value = as_number(text)
            if (text or not optional) and (value is None or (whole and not value.is_integer())):
                kind = "a whole number" if whole else "a number"
                cure = "Write a decimal point, and no separators." if "," in text else None
                raise InputError(f"{kind} belongs here", parameter=name, came=text, cure=cure)
            self._change(name, int(value) if whole and value is not None else value)

        element.on_update(self._window.settled(typed))
        self._elements[name] = (element, _show_number)

    def choice(self, name: str, label: str, options: Sequence[str], hint: str, *, none: str | None = NONE) -> None:
        """Add a list to choose from; `none` stands for nothing chosen, None where something always is."""
        element = self._window.gui.add_dropdown(label, ((none,) if none else ()) + (*options,), hint=hint)
        element.on_update(self._window.action(lambda: self._change(name, chosen(element, none or ""))))
        self._elements[name] = (element, lambda one, value: offer(one, options, value, none))

    def file(self, name: str, label: str, suffixes: Sequence[str], hint: str) -> None:
        """Add a list of the project's files with some endings."""
        element = self._window.gui.add_dropdown(label, (NONE,), hint=hint)
        element.on_update(self._window.action(lambda: self._change(name, chosen(element))))
        self._elements[name] = (
            element,
            lambda one, value: offer(one, self._window.project.names(*suffixes), value),
        )

    def flag(self, name: str, label: str, hint: str) -> None:
        """Add a box to tick."""
        element = self._window.gui.add_checkbox(label, False, hint=hint)
        element.on_update(self._window.action(lambda: self._change(name, bool(element.value))))
        self._elements[name] = (element, _show)

    def element(self, name: str) -> Any:
        """Return the field of a setting."""
        return self._elements[name][0]

    def refresh(self) -> None:
        """Show the settings as they are now."""
        now = self._now()
        for name, (element, show) in self._elements.items():
            show(element, now[name])


def _show(element: Any, value: Any) -> None:
    if element.value != value:
        element.value = value


def _show_text(element: Any, value: str | None) -> None:
    _show(element, value or "")


def _show_number(element: Any, value: float | None) -> None:
    if value is None:
        _show(element, "")
    elif as_number(str(element.value).strip()) != value:
        element.value = f"{value:.15g}"
