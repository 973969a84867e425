"""What a verb of the program finds: JSON as an object, words, a page."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

T = TypeVar("T")


class Answer(Mapping[str, Any]):
    """What a verb found: the JSON that the program prints, and its words.

    ``answer["dof"]`` is a value, ``answer.to_dict()`` all of them, ``str(answer)`` the text.
    """

    def __init__(self, found: dict[str, Any], text: str) -> None:
        self._found, self.text = found, text

    def to_dict(self) -> dict[str, Any]:
        """The object of ``--json``."""
        return self._found

    def __getitem__(self, key: str) -> Any:
        return self._found[key]

    def __iter__(self) -> Any:
        return iter(self._found)

    def __len__(self) -> int:
        return len(self._found)

    def __str__(self) -> str:
        return self.text

    def _repr_html_(self) -> str:
        from html import escape

        return f"<pre>{escape(self.text)}</pre>"


class Analysis(Answer):
    """An analysis with a page, which is computed when it is asked for."""

    def __init__(self, found: dict[str, Any], text: str, page: Callable[[], str]) -> None:
        super().__init__(found, text)
        self._page = page

    def page(self) -> str:
        """The page, as the program writes it: HTML that needs no other file."""
        return self._page()

    def view(self) -> Any:
        """Shows the page: in a notebook a frame, elsewhere the browser."""
        from ._page import show

        return show(self.page(), str(self["model"]))


def interruptible(call: Callable[[], T]) -> T:
    """What a call without a place to stop gives; Ctrl-C is heard, and leaves it to end unheard."""
    import threading

    if threading.current_thread() is not threading.main_thread():
        return call()
    found: list[T] = []
    raised: list[BaseException] = []

    def go() -> None:
        try:
            found.append(call())
        except BaseException as error:
            raised.append(error)

    thread = threading.Thread(target=go, daemon=True)
    thread.start()
    while thread.is_alive():
        thread.join(0.05)
    if raised:
        raise raised[0]
    return found[0]
