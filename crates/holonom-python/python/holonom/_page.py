"""Pages in a notebook or a browser."""

from __future__ import annotations

from typing import Any


def show(html: str, name: str) -> Any:
    """In a notebook the frame of a page, elsewhere the browser; ``name`` of its file."""
    import tempfile
    import webbrowser
    from pathlib import Path

    try:
        from IPython.core.getipython import get_ipython  # type: ignore[import-not-found]
        from IPython.display import HTML  # type: ignore[import-not-found]

        if get_ipython() is not None:
            return HTML(frame(html))
    except ImportError:
        pass
    file = Path(tempfile.mkdtemp(prefix="holonom-")) / f"{name}.html"
    file.write_text(html, encoding="utf-8")
    if not webbrowser.open(file.as_uri()):
        print(f"no browser was found: open {file}")
    return None


def frame(html: str) -> str:
    """A page in a frame that runs its scripts alone."""
    from html import escape

    page = escape(html, quote=True)
    size = 'width="100%" height="640" style="border:0"'
    return f'<iframe sandbox="allow-scripts" {size} srcdoc="{page}"></iframe>'
