"""How the package is built: by maturin, with the library of functional mock-up units beside it."""

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import maturin
from maturin import (  # noqa: F401  hooks that stay what they are
    build_sdist,
    get_requires_for_build_editable,
    get_requires_for_build_sdist,
    get_requires_for_build_wheel,
    prepare_metadata_for_build_editable,
    prepare_metadata_for_build_wheel,
)

FOLDER = Path(__file__).resolve().parents[1]
COMMAND = "cargo build --profile unwinding -p holonom-fmi --message-format json-render-diagnostics"


def add_library() -> None:
    """Builds the library of units and copies it into the package."""
    said = subprocess.run(COMMAND.split(), cwd=FOLDER, stdout=subprocess.PIPE, text=True, check=True)
    for line in said.stdout.splitlines():
        message = json.loads(line)
        for file in map(Path, message.get("filenames", [])):
            if message["target"]["name"] == "holonom_fmi" and file.suffix in (".so", ".dylib", ".dll"):
                shutil.copyfile(file, FOLDER / "python" / "holonom" / file.name)


def build_wheel(folder: str, *options: Any) -> str:
    """The wheel, by PEP 517."""
    add_library()
    return maturin.build_wheel(folder, *options)


def build_editable(folder: str, *options: Any) -> str:
    """The wheel of an editable installation, by PEP 660."""
    add_library()
    return maturin.build_editable(folder, *options)
