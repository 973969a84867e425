"""Functional mock-up units that the package writes, with the library that it holds."""

import json
import zipfile
from pathlib import Path

import numpy as np
import pytest
from conftest import program

import holonom as hn

ARM = """
model = { name = "arm", gravity = [0.0, 0.0, -9.81] }
parameters = { load = 1.5 }
simulation = { step = 0.002, end = 0.4 }
signal = [{ name = "wanted", start = 0.3 }]
body = [{ name = "link", mass = "= load", inertia = [0.01, 0.1, 0.1], position = [0.5, 0.0, 0.0] }]
joint = [{ name = "hinge", type = "revolute", parent = "ground", child = "link", position = [0.0, 0.0, 0.0], axis = [0.0, 1.0, 0.0] }]
law = [{ name = "drive", joint = "hinge", effort = "40*(wanted - x) - 4*v" }]
sensor = [{ name = "angle", type = "joint_coordinate", of = "hinge" }]
"""
CANTILEVER = {
    "model": {"name": "whip", "gravity": [0.0, 0.0, -9.81]},
    "simulation": {"step": 0.002, "end": 0.1},
    "beam": [
        {
            "name": "rod",
            "points": [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]],
            "elements": 4,
            "normal": [0.0, 0.0, 1.0],
            "start": "clamped",
            "section": hn.section(hn.rectangle(0.02, 0.02), E=2e9, nu=0.3, density=1200.0),
        }
    ],
    "sensor": [{"name": "end", "type": "position", "of": "rod.end"}],
}
FOUR_BAR = """
model = { name = "loop", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.002, end = 0.2 }
body = [
    { name = "a", mass = 1.0, inertia = [0.01, 0.1, 0.1], position = [0.0, 0.0, 0.5] },
    { name = "b", mass = 1.0, inertia = [0.1, 0.1, 0.01], position = [1.0, 0.0, 1.0] },
    { name = "c", mass = 1.0, inertia = [0.01, 0.1, 0.1], position = [2.0, 0.0, 0.5] },
]
joint = [
    { name = "pa", type = "revolute", parent = "ground", child = "a", position = [0.0, 0.0, 0.0], axis = [0.0, 1.0, 0.0], rate = 0.5, motor = { effort = 1.0 } },
    { name = "pb", type = "revolute", parent = "a", child = "b", position = [0.0, 0.0, 1.0], axis = [0.0, 1.0, 0.0] },
    { name = "pc", type = "revolute", parent = "b", child = "c", position = [2.0, 0.0, 1.0], axis = [0.0, 1.0, 0.0] },
    { name = "pd", type = "revolute", parent = "c", child = "ground", position = [2.0, 0.0, 0.0], axis = [0.0, 1.0, 0.0] },
]
sensor = [{ name = "crank", type = "joint_coordinate", of = "pa" }, { name = "bearing", type = "reaction", of = "pd" }]
"""
LOOP = FOUR_BAR.replace("step = 0.002", "step = 0.002, project_start = true")
MODELS = [
    hn.Model.from_toml(ARM).replace({"parameters.load": 2.5}),
    hn.Model.from_dict(CANTILEVER),
    hn.Model.from_toml(LOOP),
]


@pytest.mark.parametrize(("model", "fmi"), list(zip(MODELS, [3, 2, 3], strict=True)), ids=["arm", "whip", "loop"])
def test_a_unit_of_the_package_repeats_the_run_bit_for_bit(
    model: hn.Model, fmi: int, tmp_path: Path
) -> None:
    file = tmp_path / "unit.fmu"
    said = model.export_fmu(file, fmi=fmi)
    assert said["model"] == model.name and len(said["platforms"]) == 1 and str(file) in str(said)
    with zipfile.ZipFile(file) as archive:
        names = archive.namelist()
        assert archive.testzip() is None and "modelDescription.xml" in names
        assert sum(name.startswith("binaries/") for name in names) == 1
    fmpy = pytest.importorskip("fmpy")
    outputs = [own["name"] for own in said["outputs"]]
    run = hn.simulate(model)
    step, end = model.settings["step"], model.settings["end"]
    found = fmpy.simulate_fmu(
        str(file), stop_time=end, output_interval=step, output=outputs, validate=True
    )
    assert len(found["time"]) == len(run.t)
    seen = 0
    for sensor in model.sensors:
        parts, _ = run.sensors.below(sensor)
        columns = run.sensors[sensor].reshape(len(run.t), -1)
        names = [f"{sensor}.{part}" for part in parts] if columns.shape[1] > 1 else [sensor]
        is_reaction = model.sensors[sensor]["type"] == "reaction"  # there of the acceleration level
        for name, column in zip(names, columns.T, strict=True):
            if is_reaction:
                continue
            seen += 1
            assert np.array_equal(found[name], column), name
    assert seen > 0


def test_what_is_asked_for_is_in_the_unit(tmp_path: Path) -> None:
    model = MODELS[0]
    said = model.export_fmu(tmp_path / "a.fmu", inputs=["hinge", "link.force"], parameters=["body.link.inertia.0"])
    names = {kind: [own["name"] for own in said[kind]] for kind in ("inputs", "parameters")}
    assert names["inputs"] == ["hinge.effort", "link.force.x", "link.force.y", "link.force.z", "wanted"]
    assert said["parameters"][0] == {"name": "parameters.load", "unit": "", "start": 2.5}
    assert "body.link.inertia.'0'" in names["parameters"]  # as the standard quotes it
    # as the program of the package says, with the library of the package
    file = tmp_path / "arm.toml"
    file.write_text(ARM)
    answer = program("export-fmu", str(file), "-o", str(tmp_path / "b.fmu"), "--set", "parameters.load=2.5", "--json")
    assert answer.returncode == 0, answer.stderr
    plain = model.export_fmu(tmp_path / "c.fmu").to_dict()
    assert json.loads(answer.stdout) == plain | {"file": str(tmp_path / "b.fmu")}
    members = [zipfile.ZipFile(tmp_path / name).namelist() for name in ("b.fmu", "c.fmu")]
    assert members[0] == members[1]


def test_what_is_no_unit_is_refused_and_leaves_no_file(tmp_path: Path) -> None:
    file, model = tmp_path / "arm.fmu", MODELS[0]
    with pytest.raises(hn.InvalidModel, match="did you mean `hinge`"):
        model.export_fmu(file, inputs=["hing"])
    with pytest.raises(hn.InvalidModel, match="no number at this key"):
        model.export_fmu(file, parameters=["body.link.name"])
    with pytest.raises(hn.InvalidModel, match="no motion"):
        model.replace({"simulation.scheme": "static"}).export_fmu(file)
    with pytest.raises(ValueError, match="fmi: 2 or 3, not 1"):
        model.export_fmu(file, fmi=1)
    with pytest.raises(hn.OutputFailed, match="--library"):
        model.export_fmu(file, libraries=[Path(__file__)])
    with pytest.raises(hn.OutputFailed, match="nowhere.so"):
        model.export_fmu(file, libraries=["nowhere.so"])
    with pytest.raises(hn.OutputFailed, match="No such file"):
        model.export_fmu(tmp_path / "none" / "arm.fmu")
    assert not list(tmp_path.iterdir())
    file.write_text("mine")
    with pytest.raises(hn.OutputExists, match="force=True"):
        model.export_fmu(file)
    assert file.read_text() == "mine"
    model.export_fmu(file, force=True)
    assert zipfile.is_zipfile(file) and list(tmp_path.iterdir()) == [file]
