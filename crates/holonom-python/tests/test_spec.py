"""Models that are written in Python: the same models, bits and words as files of the same content."""

import copy
import importlib.util
import json
import os
import pickle
import warnings
from pathlib import Path

import numpy as np
import pytest
from conftest import MODELS, ROOT, program

import holonom as hn

CRATE = ROOT / "crates" / "holonom-python"


def four_bar() -> hn.Spec:
    """A closed loop of three bars and the ground, in the plane."""
    spec = hn.Spec("four_bar", gravity=[0, 0, -9.81], step=1e-3, end=0.2)
    corners = np.array([[0, 0, 0], [0, 0, 1], [2, 0, 1], [2, 0, 0]])
    bars: list[hn.Part | str] = ["ground"]
    for k, (a, b) in enumerate(zip(corners, corners[1:])):
        length = float(np.linalg.norm(b - a))
        shape = hn.rod(length, 0.02, density=7800)
        bars.append(spec.body(f"bar{k}", position=(a + b) / 2, shape=shape, along=b - a))
    bars.append("ground")
    for k, at in enumerate(corners):
        spec.joint(f"pin{k}", "revolute", bars[k], bars[k + 1], position=at, axis=[0, 1, 0])
    spec.joints["pin0"].rate = 1.0
    spec.simulation.project_start = True
    return spec


FOUR_BAR = """
model = { name = "four_bar", gravity = [0, 0, -9.81] }
simulation = { step = 1e-3, end = 0.2, project_start = true }
[[body]]
name = "bar0"
position = [0, 0, 0.5]
shape = { type = "rod", dimensions = [1, 0.02], density = 7800 }
[[body]]
name = "bar1"
position = [1, 0, 1]
quaternion = [0.7071067811865476, 0, 0.7071067811865475, 0]
shape = { type = "rod", dimensions = [2, 0.02], density = 7800 }
[[body]]
name = "bar2"
position = [2, 0, 0.5]
quaternion = [0, 1, 0, 0]
shape = { type = "rod", dimensions = [1, 0.02], density = 7800 }
[[joint]]
name = "pin0"
type = "revolute"
parent = "ground"
child = "bar0"
position = [0, 0, 0]
axis = [0, 1, 0]
rate = 1.0
[[joint]]
name = "pin1"
type = "revolute"
parent = "bar0"
child = "bar1"
position = [0, 0, 1]
axis = [0, 1, 0]
[[joint]]
name = "pin2"
type = "revolute"
parent = "bar1"
child = "bar2"
position = [2, 0, 1]
axis = [0, 1, 0]
[[joint]]
name = "pin3"
type = "revolute"
parent = "bar2"
child = "ground"
position = [2, 0, 0]
axis = [0, 1, 0]
"""


def test_a_loop_in_code_has_the_bits_of_its_file(tmp_path: Path) -> None:
    spec = four_bar()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        ours, theirs = hn.simulate(spec), hn.simulate(hn.Model.from_toml(FOUR_BAR))
    assert np.array_equal(ours.q, theirs.q) and np.array_equal(ours.residuals.values, theirs.residuals.values)
    found = spec.check()
    assert found["assembly"]["dof"] == 1 and "redundant" in str(found)
    spec.save(tmp_path / "models" / "four_bar.toml")
    assert hn.load(tmp_path / "models" / "four_bar.toml") == spec.compile()
    said = program("check", str(tmp_path / "models" / "four_bar.toml"), "--json")
    assert json.loads(said.stdout)["assembly"]["dof"] == 1


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_shipped_models_come_back_from_a_spec(path: Path, tmp_path: Path) -> None:
    model = hn.load(path)
    assert hn.Spec.read(path).compile() == model
    assert pickle.loads(pickle.dumps(model.spec())).compile() == model


def test_methods_are_those_of_the_schema() -> None:
    place = importlib.util.spec_from_file_location("sections", CRATE / "tools" / "sections.py")
    assert place is not None and place.loader is not None
    tool = importlib.util.module_from_spec(place)
    place.loader.exec_module(tool)
    text = tool.written(hn.schema())
    file = CRATE / "python" / "holonom" / "_sections.py"
    if os.environ.get("HOLONOM_GUIDE") == "write":
        file.write_text(text, encoding="utf-8")
    assert text == file.read_text(encoding="utf-8"), "HOLONOM_GUIDE=write renews it"


def test_numbers_keep_their_bits() -> None:
    rng = np.random.default_rng(5)
    numbers = rng.normal(size=3) * 10.0 ** rng.integers(-300, 80, size=3)
    spec = hn.Spec("bits", step=np.float64(1 / 3), end=np.float32(1.5), dimension=np.int64(3))
    body = spec.body("stone", mass=np.float64(0.1), inertia=np.full(3, 0.3), position=numbers)
    made = spec.compile().to_dict()
    assert made["body"][0]["position"] == numbers.tolist() and made["body"][0]["mass"] == 0.1
    assert made["simulation"]["step"] == 1 / 3 and made["simulation"]["end"] == 1.5
    body.mass = numbers[0] ** 0
    assert spec.compile().bodies["stone"]["mass"] == 1.0 and body.mass == 1.0
    along = rng.normal(size=3)
    spec.body("rod", shape=hn.rod(1.0, 0.01, density=1.0), along=along)
    result = hn.simulate(spec, step=0.1, end=0.1, record=["q"])
    axis = result["rod"].directors[0, 2]
    assert np.abs(axis - along / np.linalg.norm(along)).max() < 1e-15


def test_handles_stand_for_names() -> None:
    spec = hn.Spec("whip", gravity=[0, 0, -9.81], step=1e-3, end=0.01)
    section = hn.section(hn.rectangle(0.02, 0.005), E=2.1e11, nu=0.3, density=7850)
    rod = spec.beam("rod", 4, points=[[0, 0, 0], [1, 0, 0]], normal=[0, 0, 1], start="clamped", section=section)
    assert (rod.start, rod.end, rod[2]) == ("rod.start", "rod.end", "rod.2")
    spec.load("tip", body=rod.end, force=[0, 0, -5.0])
    bead = spec.body("bead", mass=0.1, inertia=[1e-5] * 3, position=[1, 0, 0])
    pin = spec.joint("pin", "spherical", rod.end, bead, position=[1, 0, 0])
    sensor = spec.sensor("force", "reaction", of=pin)
    spec.parameters["k"] = 3.0
    spec.spring("back", "ground", bead, "= k*2", natural_length=0.1)
    assert spec.compile().beams["rod"]["start"] == "clamped"
    rod.start = "pinned"
    assert spec.beams["rod"].to_dict()["start"] == "pinned"
    rod.start = "clamped"
    assert sensor.of is pin and sensor.to_dict()["of"] == "pin" and f"{pin}.fx" == "pin.fx"
    other = spec.copy()
    other.bodies["bead"].mass = 0.2
    assert spec.bodies["bead"].mass == 0.1 and list(other.joints) == ["pin"]
    other.remove("tip")
    assert "load" not in other.to_dict() and len(spec.loads) == 1
    with pytest.raises(hn.UnknownName, match="did you mean `bead`"):
        spec.bodies["beat"]
    with pytest.raises(AttributeError, match="no `wheels`"):
        spec.wheels
    with pytest.raises(KeyError):
        spec.remove("tap")
    for wrong in ([0, 0, 0], [1, 0], [np.nan, 0, 1]):
        with pytest.raises(ValueError, match="along: a direction"):
            spec.body("bad", along=wrong)


@pytest.mark.parametrize("change", [
    lambda s: s.body("bar9", mass=-1.0, inertia=[1, 1, 1]),
    lambda s: s.body("bar0", mass=1.0, inertia=[1, 1, 1]),
    lambda s: s.body("bar9", mass=1.0, inertia=np.ones((2, 2))),
    lambda s: s.body("bar9", mass=np.nan, inertia=[1, 1, 1]),
    lambda s: s.body("bar9", mass="two", inertia=[1, 1, 1]),
    lambda s: s.joint("pin9", "revolut", "ground", "bar0", position=[0, 0, 0], axis=[0, 1, 0]),
    lambda s: s.joint("pin9", "revolute", "ground", "bar7", position=[0, 0, 0], axis=[0, 1, 0]),
    lambda s: setattr(s.bodies["bar1"], "positoin", [0, 0, 0]),
    lambda s: setattr(s.simulation, "step", None),
    lambda s: setattr(s.simulation, "step", -0.1),
    lambda s: s.sensor("angle", "joint_coordinate", of="pin7"),
    lambda s: s.law("stop", joint="pin0", effort="-1e4*max(y, 0)"),
], ids=range(12))
def test_what_is_wrong_is_said_by_the_program(change, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    spec = four_bar()
    change(spec)
    with pytest.raises(hn.InvalidModel) as error:
        spec.compile()
    file = tmp_path / "wrong.toml"
    with pytest.raises(hn.InvalidModel):
        spec.save(file)
    assert not file.exists()
    file.write_text(spec.to_toml(), encoding="utf-8")
    said = json.loads(program("check", str(file), "--json").stdout)
    keys = ("message", "key", "help", "line", "column")
    ours = [{key: getattr(problem, key) for key in keys} for problem in error.value.problems]
    assert ours == [{key: problem[key] for key in keys} for problem in said["problems"]]
    assert all(problem.message in str(error.value) for problem in error.value.problems)


def test_values_that_are_no_values_are_refused() -> None:
    spec = four_bar()
    spec.body("bad", mass=object())  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="no value of a model"):
        spec.compile()
    with pytest.raises(TypeError, match="unexpected keyword"):
        spec.body("bad", mas=1.0)  # type: ignore[call-arg]
    with pytest.raises(hn.InvalidModel):
        hn.Spec.read("nowhere.toml")
    assert copy.deepcopy(four_bar()).compile() == four_bar().compile()
