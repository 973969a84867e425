"""The page of a run in a frame of a notebook: its scripts run without the origin of the notebook."""

import shutil
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import pytest

import holonom as hn
from holonom._page import Page, frame

BROWSER = next((b for b in ("chromium", "chromium-browser", "google-chrome") if shutil.which(b)), None)

PROBE = """
<!doctype html><title>none</title><body>FRAME<script>
addEventListener("message", event => { document.title = event.data; });
</script></body>
"""
ASKED = """<script>addEventListener("load", () => {
  let failed = [], slider = document.querySelector("[data-slider]");
  let members = () => document.querySelector("canvas").dataset.members;
  addEventListener("error", event => failed.push(event.message));
  document.querySelector("[data-play]").click();
  document.querySelector("[data-play]").click(); // whatever it did, it pauses or goes on
  let before = members();
  setTimeout(() => {
    slider.value = 800;
    slider.dispatchEvent(new Event("input"));
    parent.postMessage(`moved=${members() !== before} errors=${failed.join(";")}`, "*");
  }, 500);
});</script>"""


class Notebook:
    """What a notebook has of a cell."""

    kernel = None
    execution_count = 1


@pytest.fixture
def shown(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """What a notebook shows."""
    core = pytest.importorskip("IPython.core.getipython")
    monkeypatch.setattr(core, "get_ipython", Notebook)
    found: list[Any] = []
    monkeypatch.setattr("IPython.display.display", lambda own, **options: found.append(own))
    return found


def test_a_notebook_gets_the_frame_and_a_still(double: str, shown: list[Any]) -> None:
    result = hn.simulate(hn.Model.from_toml(double), end=0.02)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        hn.view(result)  # wherever it stands in a cell
    (page,) = shown
    assert isinstance(page, Page)
    bundle = page._repr_mimebundle_()
    assert list(bundle)[0] == "text/html" and bundle["text/html"] == frame(page.html)
    assert bundle["image/svg+xml"].startswith("<svg") and "double" in bundle["image/svg+xml"]
    assert len(bundle["text/plain"]) < 100 and len(result._repr_html_()) < 5000  # notebooks stay small
    hn.modes(hn.Model.from_toml(double), at="static", count=1).view()
    assert list(shown[1]._repr_mimebundle_()) == ["text/html", "text/plain"]


def test_a_terminal_with_ipython_has_a_browser(
    double: str, shown: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(Notebook, "kernel")
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    hn.simulate(hn.Model.from_toml(double), end=0.02).view()
    assert len(opened) == 1 and not shown


def test_a_drawing_of_a_cell_is_shown_once(
    double: str, shown: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without matplotlib: whether it is the last of a cell or not."""
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", None)
    result = hn.simulate(hn.Model.from_toml(double), end=0.02)
    drawings = [result.plot("angle"), result.plot("kinetic")]
    assert shown == drawings  # IPython asks them, of which cell they are
    shown.clear()
    drawings[1]._ipython_display_()  # as the last of this cell
    assert not shown
    monkeypatch.setattr(Notebook, "execution_count", 2)
    drawings[0]._ipython_display_()  # in another cell
    assert len(shown) == 1 and shown[0]["image/svg+xml"] == drawings[0].svg


@pytest.mark.skipif(BROWSER is None, reason="no Chromium")
def test_the_page_moves_in_a_frame_without_origin(double: str, tmp_path: Path) -> None:
    page = hn.simulate(hn.Model.from_toml(double)).page()
    text = frame(page.replace("</body>", ASKED + "</body>"))
    assert 'sandbox="allow-scripts"' in text
    file = tmp_path / "notebook.html"
    file.write_text(PROBE.replace("FRAME", text), encoding="utf-8")
    words = [str(BROWSER), "--headless", "--no-sandbox", "--disable-gpu", "--disable-features=IsolateSandboxedIframes", f"--user-data-dir={tmp_path}/profile"]
    words += ["--virtual-time-budget=8000", "--dump-dom", file.as_uri()]
    said = subprocess.run(words, capture_output=True, text=True, timeout=120).stdout
    title = said[said.index("<title>") + 7 : said.index("</title>")]
    print(title)
    assert title == "moved=true errors="
