"""The page of the guide: its blocks run in their order, and print what the page shows."""

import contextlib
import io
import re
import warnings
from pathlib import Path

import pytest
from conftest import ROOT, program

PAGE = ROOT / "docs" / "guide" / "src" / "python.md"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"`(\w+\.toml)`:\s*\Z")


def test_the_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = PAGE.read_text(encoding="utf-8")
    names: dict[str, object] = {"__name__": "page"}
    printed, shown, wrong = "", 0, []
    for block in BLOCK.finditer(text):
        language, content = block.groups()
        line = text[: block.start()].count("\n") + 1
        if language == "toml":
            file = FILE.search(text[: block.start()])
            assert file, f"line {line}: no name of a file"
            Path(file[1]).write_text(content, encoding="utf-8")
        elif language == "sh":
            for command in content.splitlines():
                assert program(*command.split()[1:]).returncode == 0, command
        elif language == "python":
            out = io.StringIO()
            with contextlib.redirect_stdout(out), warnings.catch_warnings():
                warnings.simplefilter("ignore")
                exec(compile(content, f"python.md:{line}", "exec"), names)
            printed = out.getvalue()
        elif language == "output":
            shown += 1
            if printed != content:
                wrong.append(f"line {line}:\n{printed}")
    assert not wrong, "\n".join(wrong)
    assert shown >= 6
