"""What a page of the window is."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Protocol

if TYPE_CHECKING:
    from truearm.studio.window import Window


class Page(Protocol):
    """One page: a tab of the window.

    Its ``__init__`` is called once inside its tab, and adds its elements with ``window.gui``. Its callbacks are made
    with :meth:`truearm.studio.window.Window.action`, so that a refusal is shown where the user acted.
    """

    title: ClassVar[str]

    def __init__(self, window: Window) -> None: ...

    def refresh(self) -> None:
        """Show what is true now: the settings, a file or a result has changed."""
