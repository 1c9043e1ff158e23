"""Refusals, each below the element of a page that somebody acted on.

What is relied on of viser: an element knows in which container it stands (``_impl.parent_container_id``), elements of a
container stand in the order of their numbers ``order``, and those that are given no number count on by one.
"""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import dataclass
from typing import Any, Final

import viser

from truearm.studio import words

#: Between an element and the next one.
_BELOW: Final = 0.5


@dataclass(eq=False)
class _Refusal:
    """What stands below an element, and the value that was refused, where somebody has typed it."""

    element: Any
    said: Any
    typed: Any = None


class Refusals:
    """The refusals that are shown on the pages; its user holds a lock."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._gui = gui
        self._standing: list[_Refusal] = []

    def put(self, element: Any, text: str) -> bool:
        """Show a refusal below an element, in place of what stands there; return whether there is such a place."""
        state = getattr(element, "_impl", None)
        container = self._gui._container_handle_from_uuid.get(getattr(state, "parent_container_id", None) or "")
        if state is None or container is None or state.removed:
            return False
        self.remove([one for one in self._standing if one.element is element])
        within: Any = container if hasattr(container, "__enter__") else nullcontext()  # the window itself is none
        with within:
            said = self._gui.add_html(words.refused(text), order=element.order + _BELOW)
        self._standing.append(_Refusal(element, said))
        return True

    def keep_typed(self, element: Any, value: Any) -> None:
        """Let a field show what was typed as long as its refusal stands, so that it can be corrected.

        None lets it no longer.
        """
        for refusal in self._standing:
            if refusal.element is element:
                refusal.typed = value

    def standing(self) -> list[_Refusal]:
        """Return those that stand now."""
        return [*self._standing]

    def remove(self, refusals: list[_Refusal]) -> bool:
        """Take some away; return whether fields show what was refused with them."""
        for refusal in refusals:
            if refusal in self._standing:
                self._standing.remove(refusal)
                if not refusal.said._impl.removed:
                    refusal.said.remove()
        return any(refusal.typed is not None and not refusal.element._impl.removed for refusal in refusals)

    def shown_anew(self) -> None:
        """After the pages have shown what holds: fields show again what was typed, and lost elements lose theirs."""
        self.remove([one for one in self._standing if one.element._impl.removed or one.said._impl.removed])
        for refusal in self._standing:
            if refusal.typed is not None:
                refusal.element.value = refusal.typed
