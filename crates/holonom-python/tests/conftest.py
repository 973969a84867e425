"""What the tests of the package share."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
MODELS = sorted((ROOT / "examples" / "models").glob("*.toml"))

DOUBLE = """
model = { name = "double", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.002, end = 0.4 }

[[body]]
name = "upper"
mass = 1.0
inertia = [0.01, 0.02, 0.02]
position = [0.5, 0.0, 0.0]

[[body]]
name = "lower"
mass = 0.5
inertia = [0.01, 0.02, 0.02]
position = [1.5, 0.0, 0.0]

[[joint]]
name = "shoulder"
type = "revolute"
parent = "ground"
child = "upper"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]

[[joint]]
name = "elbow"
type = "revolute"
parent = "upper"
child = "lower"
position = [1.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]

[[sensor]]
name = "angle"
type = "joint_coordinate"
of = "elbow"

[[sensor]]
name = "bearing"
type = "reaction"
of = "shoulder"
"""


@pytest.fixture
def double() -> str:
    """A double pendulum with sensors."""
    return DOUBLE


def program(*words: str, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """The program of the package."""
    command = [sys.executable, "-c", "from holonom_program import main; main()", *words]
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, env=os.environ)
