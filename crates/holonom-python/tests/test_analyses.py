"""Critical loads, Campbell diagrams, responses, costs: the JSON, words and pages of the program."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import program

import holonom as hn

STRIP = """
model = { name = "strip" }
simulation = { step = 0.1, end = 1.0, scheme = "static" }

[[beam]]
name = "strut"
points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
elements = 4
normal = [0.0, 0.0, 1.0]
section = { shape = { type = "rectangle", dimensions = [0.01, 0.02] }, material = { E = 2.1e11, nu = 0.3, density = 7850.0 } }
start = "clamped"

[[load]]
name = "press"
body = "strut.end"
force = [-1000.0, 0.0, 0.0]

[[sensor]]
name = "tip"
type = "position"
of = "strut.end"
"""

TURNING = """
model = { name = "turning" }
simulation = { step = 0.001, end = 0.01 }

[[body]]
name = "hub"
mass = 1.0
inertia = [0.1, 0.1, 0.1]
position = [0.0, 0.0, 0.0]
angular_velocity = [0.0, 0.0, 5.0]

[[body]]
name = "arm"
mass = 1.0
inertia = [0.01, 0.1, 0.1]
position = [1.0, 0.0, 0.0]
velocity = [0.0, 5.0, 0.0]
angular_velocity = [0.0, 0.0, 5.0]

[[joint]]
name = "axle"
type = "revolute"
parent = "ground"
child = "hub"
position = [0.0, 0.0, 0.0]
axis = [0.0, 0.0, 1.0]

[[joint]]
name = "flap"
type = "revolute"
parent = "hub"
child = "arm"
position = [0.2, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
"""


def write(place: Path, text: str) -> str:
    file = place / "model.toml"
    file.write_text(text)
    return str(file)


def test_critical_loads(tmp_path: Path) -> None:
    file = write(tmp_path, STRIP)
    found = hn.modes(file, buckling=True, count=2)
    said = program("modes", file, "--buckling", "-n", "2", "--json")
    assert found.to_dict() == json.loads(said.stdout)
    assert str(found) == program("modes", file, "--buckling", "-n", "2").stdout
    # Euler, about the weak axis: π² EI/(4 L²)
    euler = np.pi**2 * 2.1e11 * 0.02 * 0.01**3 / 12 / 4 / 1000.0
    print(found.load_factors, euler)
    assert found.load_factors.shape == (2,) and abs(found.load_factors[0] / euler - 1) < 1e-3
    assert "critical loads" in found.page()
    assert np.isnan(hn.modes(file, count=2).load_factors).all()
    with pytest.raises(hn.AnalysisFailed, match=r"(?s)state a \[\[load\]\]"):
        hn.modes(hn.load(file).replace({"load.press.force": [0.0, 0.0, 0.0]}), buckling=True)


def test_modes_over_the_speed(tmp_path: Path) -> None:
    file = write(tmp_path, TURNING)
    found = hn.campbell(file, np.linspace(2.0, 10.0, 3), count=1)
    words = ("modes", file, "--speeds", "2:10:3", "-n", "1")
    assert found.to_dict() == json.loads(program(*words, "--json").stdout)
    assert str(found) == program(*words).stdout
    # a blade with hinge offset e: ω² = Ω² (1 + e m s/J), s = 0.8, J = 0.1 + 0.64 − the part of
    # its own centrifugal moment
    own, s, e = 0.1 + 0.8**2, 0.8, 0.2
    wanted = np.sqrt((0.1 - 0.01 + s * (s + e)) / own) * found.speeds
    print(found.frequencies[:, 0] * 2 * np.pi, wanted)
    assert found.frequencies.shape == (3, 1)
    assert np.abs(found.frequencies[:, 0] * 2 * np.pi - wanted).max() < 1e-6
    assert "Campbell diagram" in found.page()
    with pytest.raises(ValueError, match="finite"):
        hn.campbell(file, [np.nan])


def test_a_response(tmp_path: Path) -> None:
    file = write(tmp_path, STRIP)
    model = hn.load(file).replace({"simulation.scheme": "nodal", "load.press.force": [0.0, 0.0, 1.0]})
    model.save(tmp_path / "shaken.toml")
    found = hn.response(model, "load.press", (1.0, 30.0, 5), damping_ratios=[0.02])
    words = ["response", str(tmp_path / "shaken.toml"), "--input", "load.press"]
    words += ["--band", "1:30:5", "--damping-ratio", "0.02"]
    assert found.to_dict() == json.loads(program(*words, "--json").stdout)
    assert str(found) == program(*words).stdout
    at = found.amplitude("tip.z").argmax()
    print(found.frequencies[at], found.amplitude("tip.z")[at], found.phase("tip.z")[at])
    assert found.transfer("tip.z").shape == found.frequencies.shape
    assert abs(abs(found.transfer("tip.z")[at]) - found.amplitude("tip.z").max()) < 1e-15
    assert abs(found.phase("tip.z")[at] + np.pi / 2) < 0.05  # a resonance
    assert "harmonic response" in found.page()
    with pytest.raises(hn.UnknownName, match="tip.z"):
        found.amplitude("tip.zz")
    wrongs: list[dict[str, Any]] = [
        {"band": (5.0, 1.0, 9)},
        {"band": (1.0, 5.0, 1)},
        {"damping_ratios": [1.5]},
        {"rayleigh": (-1.0, 0.0)},
        {"inputs": "load.pull"},
        {"inputs": "shake"},
    ]
    usual: dict[str, Any] = {"inputs": "load.press", "band": (1.0, 30.0, 5), "damping_ratios": [0.02]}
    for wrong in wrongs:
        with pytest.raises(hn.AnalysisFailed) as refused:
            hn.response(model, **(usual | wrong))
        print(refused.value)


def test_the_cost_of_a_step(double: str) -> None:
    found = hn.bench(hn.Model.from_toml(double), schemes=["nodal"], steps=20)
    assert found["schemes"][0]["scheme"] == "nodal" and found["schemes"][0]["cost"]["step"] > 0.0
    assert "nodal" in str(found)
    with pytest.raises(hn.AnalysisFailed, match="no steps"):
        hn.bench(hn.Model.from_toml(double), schemes=["static"])


def test_units_are_those_of_the_columns(double: str) -> None:
    result = hn.simulate(hn.Model.from_toml(double), end=0.02)
    assert result.sensors.unit("angle") == "rad" and result.sensors.unit("bearing") == "N, N·m"
    assert result.energy.unit("kinetic") == "J" and result.residuals.unit("newton_iterations") == ""
    own = dict(zip(result.table("trajectory").columns, result.table("trajectory").units, strict=True))
    assert [own[name] for name in ("t", "upper.x", "upper.d1x", "Lz", "Px", "E")] == [
        "s", "m", "", "kg·m²/s", "kg·m/s", "J",
    ]
    with pytest.raises(hn.UnknownName):
        result.sensors.unit("angel")
