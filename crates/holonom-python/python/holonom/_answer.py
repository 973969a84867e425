"""What a verb of the program finds: JSON as an object, words, a page."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from . import _core
from ._errors import no_panic

T = TypeVar("T")

PATIENCE = 0.5
"""How long a call that is no longer wanted is waited for, s."""


class Answer(Mapping[str, Any]):
    """What a verb found: the JSON that the program prints, and its words.

    ``answer["dof"]`` is a value, ``answer.to_dict()`` all of them, ``str(answer)`` the text.

    Attributes
    ----------
    text : the words.
    """

    def __init__(self, found: dict[str, Any], text: str) -> None:
        self._found, self.text = found, text

    def to_dict(self) -> dict[str, Any]:
        """The object of ``--json``.

        Returns
        -------
        dict
        """
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

    @no_panic
    def page(self) -> str:
        """The page, as the program writes it: HTML that needs no other file.

        Returns
        -------
        str
        """
        return self._page()

    def view(self) -> None:
        """Shows the page: in a notebook a frame, elsewhere the browser."""
        from ._page import show

        show(self.page(), str(self["model"]))


def interruptible(
    call: Callable[[Callable[..., object] | None], T],
    progress: Callable[..., object] | None = None,
) -> T:
    """What a long call gives that is asked for nothing in between; Ctrl-C ends it, and so does
    whatever ``progress`` raises.

    The call is made in a thread of its own, and gets what it may tell of its progress by; this
    thread waits for it, and tells ``progress``. What does not end within ``PATIENCE`` seconds, such
    as one large eigenvalue problem, is left to end unheard.
    """
    import threading

    if threading.current_thread() is not threading.main_thread():
        return call(progress)
    found: list[T] = []
    raised: list[BaseException] = []
    told: deque[tuple[Any, ...]] = deque()
    stop, ended = _core.Interruption(), threading.Event()  # a join that is interrupted is lost

    def go() -> None:
        try:
            found.append(stop.during(lambda: call(None if progress is None else tell)))
        except BaseException as error:
            raised.append(error)
        finally:
            ended.set()

    def tell(*words: Any) -> None:
        told.append(words)

    def hand_on() -> None:
        while told and progress is not None:
            progress(*told.popleft())

    thread = threading.Thread(target=go, daemon=True)
    try:
        thread.start()
        while not ended.wait(0.05):
            hand_on()
        hand_on()
    except BaseException:
        stop.ask()
        if ended.wait(PATIENCE):
            thread.join()
        raise
    if raised:
        raise raised[0]
    return found[0]
