"""Pages and drawings in a notebook or a browser."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any


class Page:
    """A page that a notebook shows in a frame; viewers without frames show its still."""

    def __init__(self, html: str, still: str | None) -> None:
        self.html, self.still = html, still

    def _repr_mimebundle_(self, **_options: Any) -> dict[str, str]:
        """What a notebook chooses from, the page first."""
        bundle = {"text/html": frame(self.html), "text/plain": repr(self)}
        return bundle if self.still is None else {**bundle, "image/svg+xml": self.still}

    def __repr__(self) -> str:
        return "<a page of holonom>"


class Drawing:
    """A drawing, which a notebook shows: wherever in a cell it is made, as those of matplotlib, once.

    Attributes
    ----------
    svg : the drawing as SVG.
    name : its name.
    """

    def __init__(self, svg: str, name: str) -> None:
        self.svg, self.name = svg, name
        self._cell: Any = None  # that has shown it

    def _draw(self) -> Drawing:
        """Shows it in the cell of a notebook that makes it."""
        notebook = shell()
        if notebook is not None:
            display(self)
            self._cell = getattr(notebook, "execution_count", None)
        return self

    def _ipython_display_(self) -> None:
        notebook = shell()
        if self._cell is None or getattr(notebook, "execution_count", None) != self._cell:
            display({"image/svg+xml": self.svg, "text/plain": repr(self)}, raw=True)

    def save(self, path: str | PathLike[str]) -> None:
        """Writes the SVG to a file.

        Parameters
        ----------
        path : the file.
        """
        Path(path).write_text(self.svg, encoding="utf-8")

    def view(self) -> None:
        """Shows it in the browser."""
        in_browser(self.svg, f"{self.name}.svg")

    def _repr_svg_(self) -> str:
        return self.svg

    def __repr__(self) -> str:
        return f"<holonom.Drawing of {self.name!r}>"


def shell() -> Any:
    """The notebook that this runs in; ``None`` elsewhere, in a terminal with IPython too."""
    try:
        from IPython.core.getipython import get_ipython  # type: ignore[import-not-found,unused-ignore]
    except ImportError:
        return None
    found = get_ipython()
    return found if hasattr(found, "kernel") else None


def display(what: Any, **options: Any) -> None:
    """Shows something in the present cell."""
    from importlib import import_module

    import_module("IPython.display").display(what, **options)


def show(html: str, name: str, still: str | None = None) -> None:
    """In a notebook the frame of a page, elsewhere the browser; ``name`` of its file."""
    if shell() is None:
        in_browser(html, f"{name}.html")
    else:
        display(Page(html, still))


def in_browser(content: str, name: str) -> None:
    """Writes a file to a folder of its own and opens it."""
    import tempfile
    import webbrowser

    file = Path(tempfile.mkdtemp(prefix="holonom-")) / name
    file.write_text(content, encoding="utf-8")
    if not webbrowser.open(file.as_uri()):
        print(f"no browser was found: open {file}")


def frame(html: str) -> str:
    """A page in a frame that runs its scripts alone."""
    from html import escape

    page = escape(html, quote=True)
    size = 'width="100%" height="640" style="border:0"'
    return f'<iframe sandbox="allow-scripts" {size} srcdoc="{page}"></iframe>'
