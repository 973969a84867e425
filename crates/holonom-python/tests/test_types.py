"""Stubs, types, examples of docstrings."""

import doctest
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

import holonom as hn

PACKAGE = Path(hn.__file__).parent
MODULES = ["_acting", "_ensemble", "_model", "_result", "_simulate", "_spec", "_stepper", "_sweep", "_verbs"]


@pytest.mark.parametrize("name", MODULES)
def test_examples_of_docstrings_run(name: str) -> None:
    module = importlib.import_module(f"holonom.{name}")
    found = doctest.testmod(module, extraglobs={key: getattr(hn, key) for key in hn.__all__})
    assert found.failed == 0
    print(f"{name}: {found.attempted} lines")


def test_the_types_are_strict() -> None:
    for needed in ("mypy", "gymnasium"):
        pytest.importorskip(needed)
    tests = [str(path) for path in Path(__file__).parent.glob("*.py")]
    words = [sys.executable, "-m", "mypy", "--strict", "--no-incremental", "--cache-dir", "/dev/null", str(PACKAGE)]
    words.append(str(PACKAGE.with_name("holonom_program")))
    words += tests
    said = subprocess.run(words, capture_output=True, text=True)
    assert said.returncode == 0, said.stdout


def test_the_stub_is_that_of_the_module() -> None:
    pytest.importorskip("mypy")
    words = [sys.executable, "-m", "mypy.stubtest", "holonom._core", "--ignore-missing-stub"]
    said = subprocess.run(words, capture_output=True, text=True, cwd=PACKAGE.parent)
    assert said.returncode == 0, said.stdout
